"""Symplectic Euler: the integrator that XPBD builds on."""

from __future__ import annotations

from .integrator import Integrator


class SymplecticEuler(Integrator):
    """v += w f dt; x += v dt. First order, symplectic; the integrator that XPBD builds on."""

    title = "symplectic_euler"
    order = 1

    def advance(self, dt: float) -> None:
        self.move(dt, dt)
