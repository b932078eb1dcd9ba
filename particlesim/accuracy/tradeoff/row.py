"""Row: one setting of a sweep, and what was measured of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...scene.settings import Settings
from ..statistics import Interval, independent, median
from ..table import assignments


@dataclass(frozen=True)
class Row:
    """One setting of a sweep, and what was measured of it.

    Args:
        values: What was varied, by name.
        settings: All knobs.
        options: Of ``build``.
        error: Of the seeds the median; not finite if the run stopped before.
        cause: Why it counts as diverged; empty if it does not.
        costs: Wall seconds per simulated second, one a repeat.
        particles: How many.
        array_bytes: Of all arrays of the simulation.
        cpu_costs: Likewise the CPU seconds of all threads of the process.
        set_up: Seconds of making the simulation.
        compiling: Seconds that its first frames took longer than later ones.
        errors: One a seed.
        relative: The error over the scale that the table names; nan if it names none.
        parts: Further errors by name: ``worst``, of the worst particle; ``velocity``.
    """

    values: dict[str, Any]
    settings: Settings
    options: dict[str, Any]
    error: float
    cause: str
    costs: tuple[float, ...]
    particles: int
    array_bytes: int
    cpu_costs: tuple[float, ...] = ()
    set_up: float = math.nan
    compiling: float = math.nan
    errors: tuple[float, ...] = ()
    relative: float = math.nan
    parts: dict[str, float] = field(default_factory=dict)

    @property
    def diverged(self) -> bool:
        """Whether it stopped, ended without a finite error, or ended beyond the bound."""
        return bool(self.cause)

    @property
    def cost(self) -> float:
        """Median wall seconds per simulated second; nan if not one frame was done."""
        return float(np.median(self.costs)) if self.costs else math.nan

    @property
    def cpu_cost(self) -> float:
        """Median CPU seconds per simulated second, of all threads."""
        return float(np.median(self.cpu_costs)) if self.cpu_costs else math.nan

    @property
    def spread(self) -> float:
        """Half of what lies between the fastest and the slowest repeat, over the cost."""
        return (max(self.costs) - min(self.costs)) / (2 * self.cost) if self.costs else math.nan

    @property
    def rate(self) -> float:
        """Particle-substeps per wall second."""
        return self.particles / (self.settings.substep * self.cost) if self.costs else math.nan

    @property
    def interval(self) -> Interval:
        """Where the median of all seeds lies, with 95 %; the error itself where there is one."""
        return median(self.errors)[1] if len(self.errors) > 1 else Interval(self.error, self.error)

    def surely_better(self, other: Row) -> bool:
        """Whether its error is less than another's, seed by seed, and not by chance (95 %)."""
        if len(self.errors) < 2 or len(self.errors) != len(other.errors):
            return self.error < other.error
        mine, theirs = np.array(self.errors), np.array(other.errors)
        if not (mine > 0).all() or not (theirs > 0).all():
            return bool((mine < theirs).all())
        return independent(np.log(mine / theirs)).interval().high < 0.0

    def __getitem__(self, name: str) -> Any:
        return self.values[name]

    def label(self) -> str:
        """What was varied, as ``substeps=5, precision=float32``."""
        return assignments(self.values, 6)
