"""Stability: the report of all limits on the substep."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass

from ...engine.probing.limit import Limit
from ...scene.settings import Settings


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
