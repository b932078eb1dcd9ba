"""What bounds the substep: one part's limit of one kind, and what an explicit step can take."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Limit:
    """A bound that one part of a simulation sets on the substep.

    Args:
        part: Name of the interaction or constraint.
        kind: What bounds it: ``"frequency"``, ``"damping"``, ``"sound"``, ``"speed"``...
        dt: Largest safe substep [s]; infinite: any, and ``reason`` says what is to be known.
        reason: The formula with its inputs.
        world: Where it is tightest; None: everywhere alike.
        particle: Which particle of that world.
    """

    part: str
    kind: str
    dt: float
    reason: str
    world: int | None = None
    particle: int | None = None

    @property
    def where(self) -> str:
        """World and particle in words; empty if it holds everywhere."""
        if self.particle is None:
            return ""
        return f"particle {self.particle}" + (f" in world {self.world}" if self.world else "")


def explicit_step(omega_squared: float, gamma: float = 0.0) -> float:
    """Largest stable step of x'' = -omega^2 x - gamma x' by either integrator [time].

    One step maps (x, v) with determinant 1 - gamma dt and trace 2 - gamma dt - omega^2 dt^2. Its
    eigenvalues stay within the unit circle while omega^2 dt^2 + 2 gamma dt <= 4: for
    dt <= 4 / (gamma + sqrt(gamma^2 + 4 omega^2)), that is 2 / omega or 2 / gamma for either alone.
    """
    rate = gamma + math.sqrt(gamma**2 + 4.0 * omega_squared)
    return 4.0 / rate if rate > 0.0 else math.inf


def predicted_step(omega_squared: float, gamma: float = 0.0) -> float:
    """The same by velocity Verlet, whose damping sees the velocity that the last force predicts.

    One step maps (x, v, a); an eigenvalue comes to -1 at omega^2 dt^2 + 4 gamma dt = 4: at
    dt = 2 / (gamma + sqrt(gamma^2 + omega^2)), that is 2 / omega or 1 / gamma for either alone.
    """
    rate = gamma + math.sqrt(gamma**2 + omega_squared)
    return 2.0 / rate if rate > 0.0 else math.inf
