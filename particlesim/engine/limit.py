"""What bounds the substep: one part's limit of one kind, and what an explicit step can take."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any

from numpy.polynomial import Polynomial


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


@dataclass
class Pacing:
    """What the substeps of adaptive frames were chosen by, as it goes on with the run.

    Args:
        limit: The tightest when limits were last asked; None: never, or at a state that is no more.
        sizes: Largest speed, acceleration and density then; none: not known.
        limiter: That by which the last frame has its number.
    """

    limit: Limit | None = None
    sizes: tuple[float, ...] = ()
    limiter: Limit | None = None

    @classmethod
    def of_saved(cls, saved: dict[str, Any]) -> Pacing:
        """Of a checkpoint's header."""
        limits = {
            name: None if saved[name] is None else Limit(**saved[name])
            for name in ("limit", "limiter")
        }
        return cls(sizes=tuple(saved["sizes"]), **limits)


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


def composed_step(stages: tuple[float, ...], omega_squared: float) -> float:
    """Largest stable step of x'' = -omega^2 x by velocity Verlet in stages [time]."""
    return composed_phase(stages) / math.sqrt(omega_squared) if omega_squared > 0.0 else math.inf


@functools.cache
def composed_phase(stages: tuple[float, ...]) -> float:
    """The omega dt up to which that is stable, and its energy bounded.

    Velocity Verlet of w dt maps (x, v / omega), with s = w omega dt, by the matrix

        1 - s^2 / 2        s
        s^3 / 4 - s    1 - s^2 / 2

    of determinant 1. A product of such matrices has eigenvalues on the unit circle while its trace
    is within -2 and 2: up to the least omega dt above 0 at which the trace, a polynomial of
    (omega dt)^2, goes through either. For one stage of 1 that is 2.
    """
    z = Polynomial([0.0, 1.0])  # (omega dt)^2; the second column lacks omega dt, the second row has
    a, b, c, d = (Polynomial([number]) for number in (1.0, 0.0, 0.0, 1.0))  # it once too often
    for w in stages:
        diagonal, turn = 1.0 - 0.5 * w**2 * z, 0.25 * w**3 * z - w
        a, b, c, d = (
            diagonal * a + w * c * z, diagonal * b + w * d, turn * a + diagonal * c,
            turn * b * z + diagonal * d,
        )  # fmt: skip
    trace = a + d
    roots = [*((trace - 2.0) // z).roots(), *(trace + 2.0).roots()]
    return math.sqrt(min(each.real for each in roots if each.real > 0 and abs(each.imag) < 1e-9))
