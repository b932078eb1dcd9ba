"""What bounds the substep: limits, one a part and kind, and the report of them all."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass

from ...scene.settings import Settings


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


@dataclass(frozen=True)
class Stability:
    """The limits of a simulation at one moment, the tightest first. ``str()`` makes a table.

    Args:
        limits: Of all parts.
        settings: What they are to be compared with.
    """

    limits: Sequence[Limit]
    settings: Settings

    @property
    def binding(self) -> Limit | None:
        """The tightest limit; None where nothing limits the substep."""
        first = self.limits[0] if self.limits else None
        return first if first is not None and first.dt < math.inf else None

    @property
    def dt(self) -> float:
        """Largest safe substep [s]; infinite where nothing limits it."""
        return math.inf if self.binding is None else self.binding.dt

    @property
    def substeps(self) -> float:
        """Substeps that a frame of ``settings.dt`` needs, a whole number; inf: no number does."""
        if self.dt <= 0.0:
            return math.inf
        return max(1, math.ceil(self.settings.dt / self.dt * (1.0 - 1e-9)))

    @property
    def safe(self) -> bool:
        """Whether the settings are within the limit."""
        return self.settings.substeps >= self.substeps

    def __str__(self) -> str:
        return "\n".join([self._heading(), "", *self._table()])

    def _heading(self) -> str:
        settings = self.settings
        now = f"substep of {settings.substep:.4g} s ({settings.substeps} of {settings.dt:.4g} s)"
        if self.binding is None:
            return f"{now}: nothing limits it"
        verdict = "within the limit" if self.safe else "PAST THE LIMIT"
        return (
            f"{now}: {verdict} of {self.dt:.4g} s, set by {self.binding.part} "
            f"({self.binding.kind}); a frame needs {self.substeps} substeps"
        )

    def _table(self) -> list[str]:
        from rich import box
        from rich.console import Console
        from rich.table import Table

        grid = Table(box=box.SIMPLE, show_edge=False, pad_edge=False)
        for name in ("part", "limit", "substep", "where", "why"):
            grid.add_column(name, justify="right" if name == "substep" else "left")
        for each in self.limits:
            step = "any" if math.isinf(each.dt) else f"{each.dt:.4g} s"
            grid.add_row(each.part, each.kind, step, each.where, each.reason)
        stream = io.StringIO()
        Console(file=stream, width=1000, color_system=None, markup=False, highlight=False).print(
            grid
        )
        return [line.rstrip() for line in stream.getvalue().splitlines()]


def explicit_step(omega_squared: float, gamma: float = 0.0) -> float:
    """Largest stable step of x'' = -omega^2 x - gamma x' by either integrator [time].

    One step maps (x, v) with determinant 1 - gamma dt and trace 2 - gamma dt - omega^2 dt^2. Its
    eigenvalues stay within the unit circle while omega^2 dt^2 + 2 gamma dt <= 4: for
    dt <= 4 / (gamma + sqrt(gamma^2 + 4 omega^2)), that is 2 / omega or 2 / gamma for either alone.
    """
    rate = gamma + math.sqrt(gamma**2 + 4.0 * omega_squared)
    return 4.0 / rate if rate > 0.0 else math.inf
