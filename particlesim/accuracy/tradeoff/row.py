"""Row: one setting of a sweep, and what was measured of it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...scene.settings import Settings
from ..table import assignments


@dataclass(frozen=True)
class Row:
    """One setting of a sweep, and what was measured of it.

    Args:
        values: What was varied, by name.
        settings: All knobs.
        options: Of ``build``.
        error: At the end; not finite if the run stopped before.
        cause: Why it counts as diverged; empty if it does not.
        costs: Wall seconds per simulated second, one a repeat.
        particles: How many.
        array_bytes: Of all arrays of the simulation.
    """

    values: dict[str, Any]
    settings: Settings
    options: dict[str, Any]
    error: float
    cause: str
    costs: tuple[float, ...]
    particles: int
    array_bytes: int

    @property
    def diverged(self) -> bool:
        """Whether it stopped, ended without a finite error, or ended beyond the bound."""
        return bool(self.cause)

    @property
    def cost(self) -> float:
        """Median wall seconds per simulated second; nan if not one frame was done."""
        return float(np.median(self.costs)) if self.costs else math.nan

    @property
    def spread(self) -> float:
        """Half of what lies between the fastest and the slowest repeat, over the cost."""
        return (max(self.costs) - min(self.costs)) / (2 * self.cost) if self.costs else math.nan

    @property
    def rate(self) -> float:
        """Particle-substeps per wall second."""
        return self.particles / (self.settings.substep * self.cost) if self.costs else math.nan

    def __getitem__(self, name: str) -> Any:
        return self.values[name]

    def label(self) -> str:
        """What was varied, as ``substeps=5, precision=float32``."""
        return assignments(self.values, 6)
