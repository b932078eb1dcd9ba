"""Velocity Verlet: one evaluation of the forces a substep, of second order."""

from __future__ import annotations

from ..limit import predicted_step
from .integrator import Integrator


class VelocityVerlet(Integrator):
    """Kick dt/2, drift dt, forces, kick dt/2 (Swope et al. 1982, eq. 9). Second order.

    With :class:`~particlesim.Langevin` in the middle of the drift it is BAOAB.

    One evaluation of the forces a substep: the first kick uses those of the last substep. Forces
    between particles that depend on velocities, as of dampers and viscosity, and those of one's own
    see what the last substep's forces would make of them by its end, v + w f dt, which is of second
    order too (Groot and Warren 1997, eq. 8).

    With rigid constraints it is RATTLE (Andersen 1983), of second order again: positions are
    projected along gradients at the start of the drift, velocities at its end.
    """

    title = "velocity_verlet"
    order = 2
    carries_forces = True

    def largest_step(self, omega_squared: float, gamma: float) -> float:
        return predicted_step(omega_squared, gamma)

    def begin(self, dt: float) -> None:
        self.move(0.5 * dt, dt)

    def foresee(self, dt: float) -> None:
        if self.predicted:
            self._launch(self.kernels.foresee, 0.5 * dt)

    def advance(self, dt: float) -> None:
        if self.predicted:
            self._launch(self.kernels.go_back)
        self.kick(0.5 * dt)
