"""Gravity between all pairs of particles."""

from __future__ import annotations

from typing import Any

import warp as wp

from .. import validate
from ..engine.probing.limit import Limit
from ..engine.probing.probe import Probe
from ..scene.law import law
from .gravity_limits import closest_approach, closest_passage
from .pair import Pair


@law
def gravity_potential(r: float, mass_i: float, mass_j: float, constant: float, softening: float):
    return -constant * mass_i * mass_j / wp.sqrt(r * r + softening * softening)


@law
def gravity_force(r: float, mass_i: float, mass_j: float, constant: float, softening: float):
    d2 = r * r + softening * softening
    return -constant * mass_i * mass_j * r / (d2 * wp.sqrt(d2))


class Gravity(Pair):
    """Newton's gravity between all pairs of a world, u = -G m_i m_j / sqrt(r^2 + s^2).

    Softened after Plummer (1911). Costs the square of the number of particles.

    Args:
        group: Which particles attract each other; None: all.
        G: [length^3 / (mass time^2)].
        softening: s [length], at least 0.

    Example:
        >>> Gravity(G=1.0, softening=0.01).cutoff is None
        True
    """

    def __init__(self, group: Any = None, G: float = 1.0, softening: float = 0.0):
        values = {
            "constant": validate.number(self.name, "G", G),
            "softening": validate.number(
                self.name, "softening", softening, minimum=0.0, unit="length"
            ),
        }
        super().__init__(gravity_potential, gravity_force, group, None, values)

    def limits(self, probe: Probe) -> list[Limit]:
        """By the tide now, by orbits' pericentres, and by passages at the softening length."""
        limits = probe.response(self) + closest_passage(self, probe)
        return limits + closest_approach(self, probe)
