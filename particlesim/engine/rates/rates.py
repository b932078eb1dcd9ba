"""Rates at which forces answer to positions and velocities, and the step that they allow."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .spectrum import Largest

if TYPE_CHECKING:
    from .integrators.integrator import Integrator

TURNING = 0.1  # of the largest rate: a smaller imaginary part is rounding
GROWTH = 20.0  # what pushes along the velocity counts for as much damping: (1 + z)^n is e^(n z)
HEED = 0.5  # of the largest rate: what is smaller is not resolved well enough


@dataclass(frozen=True)
class Rates:
    """Of the forces of one part, or of several together.

    Args:
        omega_squared: Of their answer to positions [1/time^2].
        gamma: To velocities, where the kick is explicit in them [1/time].
        implicit: To velocities, where it is not [1/time].
        turn: The part of ``gamma`` that turns velocities, where no damping makes up for it.
        turns: Whether ``implicit`` is of a force that turns them.
    """

    omega_squared: float = 0.0
    gamma: float = 0.0
    implicit: float = 0.0
    turn: float = 0.0
    turns: bool = False

    @property
    def none(self) -> bool:
        """Whether nothing answers."""
        return self.omega_squared == self.gamma == self.implicit == 0.0

    def __add__(self, other: Rates) -> Rates:
        """Bounds of what both together have."""
        return Rates(
            self.omega_squared + other.omega_squared, self.gamma + other.gamma,
            self.implicit + other.implicit, self.turn + other.turn, self.turns or other.turns,
        )  # fmt: skip

    def tightest(self, integrator: Integrator) -> tuple[str, float, str]:
        """Kind, substep and reason of what binds."""
        if not math.isfinite(self.omega_squared + self.gamma + self.implicit):
            return "force", 0.0, "the force is not finite at the present state"
        if self.turn:
            return (
                "rotation", 0.0, f"velocities turn at {self.turn:.4g} /s, and an explicit kick "
                "along the tangent gains energy at any step: give the force as a ParticleForce",
            )  # fmt: skip
        found = [self._explicit(integrator)]
        if self.implicit:
            kind, letter = ("rotation", "omega") if self.turns else ("damping", "gamma")
            reason = f"2 / {letter}, {letter} = {self.implicit:.4g} /s"
            found.append((kind, 2.0 / self.implicit, reason))
        return min(found, key=lambda each: each[1])

    def _explicit(self, integrator: Integrator) -> tuple[str, float, str]:
        omega, gamma = math.sqrt(self.omega_squared), self.gamma
        dt = integrator.largest_step(self.omega_squared, gamma)
        if not gamma:
            return "frequency", dt, f"{omega * dt:.4g} / omega, omega = {omega:.4g} /s"
        if not omega:
            return "damping", dt, f"{gamma * dt:.3g} / gamma, gamma = {gamma:.4g} /s"
        reason = f"omega = {omega:.4g} /s with gamma = {gamma:.4g} /s"
        return "frequency and damping", dt, reason


def turns(found: Largest) -> float:
    """The fastest rate at which velocities turn with less damping than that, or 0.

    An explicit kick with the eigenvalue lambda = gamma + i omega is stable to 2 gamma / |lambda|^2.
    """
    values = found.values[np.abs(found.values) >= HEED * found.size]
    loose = np.abs(values.imag) > np.maximum(values.real, TURNING * found.size)
    return float(np.abs(values.imag)[loose].max(initial=0.0))


def implicit_rates(found: Largest, damps: bool) -> tuple[float, float]:
    """Of forces that are implicit: the damping that is explicit all the same, and the rest.

    Args:
        found: Their answer to velocities.
        damps: Whether all of it is implicit, and not turning alone.
    """
    if damps or not len(found.values):
        return 0.0, found.bound
    turned = turns(found)
    damped = float(np.abs(found.values.real).max())
    if damped < TURNING * turned:
        return 0.0, found.bound
    grows = -float(found.values.real.min())
    if grows > TURNING * found.size:
        damped = max(damped, GROWTH * grows)
    return damped + found.residual, turned
