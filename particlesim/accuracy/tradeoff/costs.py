"""Costs of sweeps: a model that says what was not run, and how much faster one way is."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..table import assignments, duration
from .row import Row

FURTHER = 0.01  # of its smallest error, to which a series is extrapolated
LEAST = 0.1  # by which the logarithms of two errors differ, to draw a line through them
STEPS = ("substeps", "dt")  # what the model has terms for, with the number of particles


@dataclass(frozen=True)
class CostModel:
    """Seconds of a frame: a + b substeps + c substeps particles.

    Args:
        values: What it is of: the other values that vary, by name.
        frame: a, what a frame costs whatever its substeps [s].
        substep: b [s].
        particle: c, of each particle in each substep [s].
        off: By which part the worst row misses it.
        particles: How many there are, where that does not vary.
    """

    values: dict[str, Any]
    frame: float
    substep: float
    particle: float
    off: float
    particles: int | None

    def seconds(self, substeps: int, particles: int = 0) -> float:
        """Of one frame."""
        return self.frame + substeps * (self.substep + self.particle * particles)

    def __str__(self) -> str:
        words = f"{duration(self.frame)} + {duration(self.substep)} a substep"
        if self.particle:
            words += f" + {duration(self.particle)} a substep and particle"
        of = f" of {assignments(self.values, 3)}" if self.values else ""
        return f"a frame{of} costs {words}, within {max(100 * self.off, 1):.0f} %"


def models(rows: Sequence[Row]) -> list[CostModel]:
    """A model for every way of running that has rows of different substeps or particles."""
    rows = [row for row in rows if row.costs]
    names = list(rows[0].values) if rows else []
    left_out = {*STEPS, *(name for name in names if _decides(name, rows))}
    groups: dict[str, list[Row]] = {}
    for row in rows:
        way = {name: value for name, value in row.values.items() if name not in left_out}
        groups.setdefault(repr(way), []).append(row)
    fitted = [_fitted(group, left_out) for group in groups.values()]
    return [each for each in fitted if each is not None]


def _decides(name: str, rows: Sequence[Row]) -> bool:
    """Whether the number of particles follows from an option."""
    counts: dict[str, set[int]] = {}
    for row in rows:
        counts.setdefault(repr(row.values[name]), set()).add(row.particles)
    return len(set().union(*counts.values())) > 1 and all(len(n) == 1 for n in counts.values())


def _fitted(rows: list[Row], left_out: set[str]) -> CostModel | None:
    """The model of rows of one way; None where there is nothing to tell its terms apart by."""
    substeps = np.array([row.settings.substeps for row in rows], dtype=float)
    particles = np.array([row.particles for row in rows], dtype=float)
    cost = np.array([row.cost * row.settings.dt for row in rows])
    terms = [np.ones(len(rows)), substeps]
    if len(set(particles)) > 1:
        terms.append(substeps * particles)
    elif len(set(substeps)) < 2:
        return None
    columns = np.stack(terms, axis=1)
    found = _least_squares(columns, cost)
    frame, substep, particle = [*found, 0.0][:3]
    return CostModel(
        values={name: value for name, value in rows[0].values.items() if name not in left_out},
        frame=frame,
        substep=substep,
        particle=particle,
        off=float(np.abs(columns @ found / cost - 1.0).max()),
        particles=int(particles[0]) if len(terms) < 3 else None,
    )


def _least_squares(terms: np.ndarray, cost: np.ndarray) -> np.ndarray:
    """Coefficients of least relative deviation, none below 0: no part of a run gives time back."""
    scaled, kept = terms / cost[:, None], list(range(terms.shape[1]))
    while True:
        found = np.linalg.lstsq(scaled[:, kept], np.ones(len(cost)), rcond=None)[0]
        if (found >= 0).all() or len(kept) == 1:
            break
        kept.pop(int(np.argmin(found * np.abs(scaled[:, kept]).mean(axis=0))))
    result = np.zeros(terms.shape[1])
    result[kept] = np.maximum(found, 0.0)
    return result


# Speed at the same error ----------------------------------------------------------------------


def series_of(rows: Sequence[Row], along: str) -> dict[str, list[Row]]:
    """Rows that differ in the knob ``along`` only, by what the others are."""
    series: dict[str, list[Row]] = {}
    for row in rows:
        others = {name: value for name, value in row.values.items() if name != along}
        series.setdefault(assignments(others, 4), []).append(row)
    return series


def along_of(vary: Mapping[str, Sequence[Any]]) -> str:
    """The knob with the most values, which series follow."""
    return max(vary, key=lambda name: len(vary[name]))


def cost_at(rows: Sequence[Row], error: float) -> tuple[float, bool]:
    """What a series costs at an error, and whether it was followed beyond what was run.

    By interpolation of logarithms; beyond its smallest error by the line through the last two, as
    far as a hundredth of it. nan where it is further away, or too inaccurate to compare.
    """
    best: list[Row] = []
    for row in sorted(rows, key=lambda row: (row.cost, row.error)):
        if not row.diverged and row.error > 0 and (not best or row.error < best[-1].error):
            best.append(row)
    if not best or error > best[0].error * (1 + 1e-9):
        return math.nan, False
    x = np.log([row.error for row in reversed(best)])
    y = np.log([row.cost for row in reversed(best)])
    if error >= best[-1].error:
        return float(np.exp(np.interp(np.log(error), x, y))), False
    # What no longer falls has a floor.
    floored = max(row.cost for row in rows if not row.diverged) > best[-1].cost
    if floored or len(best) < 2 or error < FURTHER * best[-1].error or x[1] - x[0] < LEAST:
        return math.nan, True
    slope = (y[0] - y[1]) / (x[0] - x[1])
    return float(np.exp(y[0] + slope * (np.log(error) - x[0]))), True


def common_error(series: Mapping[str, Sequence[Row]]) -> float:
    """A power of ten at which to compare: the smallest that two series reach.

    Where they have none in common it is the largest of the more accurate one; nan of one series.
    """
    reached = []
    for rows in series.values():
        errors = [row.error for row in rows if not row.diverged and row.error > 0]
        if errors:
            reached.append((min(errors), max(errors)))
    if len(reached) < 2:
        return math.nan
    low = sorted(each[0] for each in reached)[1]
    high = min(each[1] for each in reached)
    power = 10.0 ** math.ceil(math.log10(low) - 1e-9)
    if power <= high:
        return power
    below = 10.0 ** math.floor(math.log10(high) + 1e-9)
    return below if low > high or below >= low else float(f"{math.sqrt(low * high):.1g}")


def speedups(rows: Sequence[Row], along: str, error: float | None) -> list[str]:
    """How many times as fast each series is as the slowest at one error, in words."""
    series = series_of(rows, along)
    error = common_error(series) if error is None else error
    costs = {name: cost_at(members, error) for name, members in series.items()}
    reached = sorted((n for n in costs if costs[n][0] > 0), key=lambda name: costs[name][0])
    if len(reached) < 2:
        return []
    slowest, at = reached[-1], _short(error)
    words = []
    for name in reached[:-1]:
        ratio = costs[slowest][0] / costs[name][0]
        doubt = max(row.spread for key in (name, slowest) for row in series[key] if row.costs)
        beyond = ", by extrapolation" if costs[slowest][1] or costs[name][1] else ""
        if ratio < 1.05 + 2.0 * doubt:
            words.append(f"{name} costs as much as {slowest} at an error of {at}, as far as told")
        else:
            words.append(
                f"{name} is {ratio:.2g} times as fast as {slowest} at an error of {at}{beyond}"
            )
    return words


def _short(value: float) -> str:
    """``1e-4`` rather than ``0.0001`` or ``1e-04``."""
    mantissa, exponent = f"{value:.1e}".split("e")
    if abs(int(exponent)) < 2:
        return f"{value:g}"
    return f"{mantissa.removesuffix('.0')}e{int(exponent)}"
