"""Row: one setting of a sweep, and what was measured of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...scene.settings import Settings
from ..table import assignments

STRAIGHT = 0.05  # largest deviation from a power law within its part, in parts of the error
STEEP = 0.5  # of the steepest straight part: what falls slower has reached a floor, or not begun

Points = tuple[np.ndarray, np.ndarray]


def converging_part(x: np.ndarray, y: np.ndarray) -> slice:
    """The longest straight part of a falling line y(x), without floors and rough beginnings.

    Args:
        x: (n,) rising: log of the knob, from coarse to fine.
        y: (n,) log of the error.

    Returns:
        The points that follow one power law: at least three, if there are; all, if none do.
    """
    least = min(3, len(x))
    straight = []
    for start in range(len(x)):
        for stop in range(start + least, len(x) + 1):
            slope, offset = np.polyfit(x[start:stop], y[start:stop], 1)
            deviation = np.abs(slope * x[start:stop] + offset - y[start:stop]).max()
            if deviation <= np.log1p(STRAIGHT):
                straight.append((stop - start, start, -slope))
    if not straight:
        return slice(0, len(x))
    steepest = max(slope for _, _, slope in straight)
    least_steep = min(steepest, STEEP * steepest)  # both may be negative
    count, start, _ = max(each for each in straight if each[2] >= least_steep)
    return slice(start, start + count)


def fitted_order(groups: Sequence[Points], direction: int) -> float:
    """One exponent p, error ~ knob^-p, for groups of points that each have a height of their own.

    Least squares in logarithms over the converging part of each group; groups that converge less
    than half as fast as the fastest do not converge by this knob and are left out.

    Args:
        groups: (knob, error) arrays, above 0, of at least two points.
        direction: 1 if a larger knob is finer, -1 if a smaller one is (the exponent is then that
            of the knob itself), 0 if whichever the errors fall with is.
    """
    sums = []
    for knob, error in groups:
        if direction == 0:
            direction = -1 if np.polyfit(np.log(knob), np.log(error), 1)[0] > 0 else 1
        x = direction * np.log(knob)
        rank = np.argsort(x, kind="stable")
        x, y = x[rank], np.log(error[rank])
        part = converging_part(x, y)
        x, y = x[part] - x[part].mean(), y[part] - y[part].mean()
        sums.append((float(x @ y), float(x @ x)))
    fastest = max(-xy / xx for xy, xx in sums)
    kept = [(xy, xx) for xy, xx in sums if -xy / xx >= min(fastest, STEEP * fastest)]
    return -sum(xy for xy, _ in kept) / sum(xx for _, xx in kept)


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
