"""Levels: samples of what is observed, at one step size."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np

from .. import statistics
from ..statistics import Mean, independent
from ..study import Plan
from .bench import Bench

PILOT = 5  # seeds that every level is run with
SAMPLES = 100_000  # of a level, at most
GROWTH = 4  # times as many in one go, at most
FACTORS = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 32.0, 64.0)  # as many, to choose from
LEAST = 0.05  # of those that there are, in one go
NEXT = 0.7  # of what seems to be missing, in one go: what scatters may scatter less than it seems


class Level:
    """A plan, and a sample for each of the first seeds, (n,); of a scene without seeds just one.

    Args:
        bench: Runs it.
        plan: Its settings and options.
        step: What is refined: a substep [s], a spacing.

    ``off`` is what is known to be too much in every sample.
    """

    off = 0.0

    def __init__(self, bench: Bench, plan: Plan, step: float):
        self.bench, self.plan, self.step = bench, plan, step
        self.rows: list[np.ndarray] = []
        self._known, self._samples = (0, -1), np.zeros(0)

    def more(self, count: int, part: str) -> None:
        """Run seeds until there are so many samples; a scene without them needs one."""
        have = len(self.rows)
        wanted = count if self.bench.chance else 1
        self.rows += list(self.bench.rows(self.plan, range(have, max(have, wanted)), part))

    @property
    def samples(self) -> np.ndarray:
        """(n,) of the seeds."""
        state = (len(self.rows), self.bench.start)
        if self._known != state:
            self._known = state
            self._samples = np.array([self._reduced(row) for row in self.rows]) - self.off
        return self._samples

    @property
    def history(self) -> np.ndarray:
        """What was observed, (n, m)."""
        return np.array(self.rows)

    @property
    def mean(self) -> Mean:
        """Of the samples."""
        return independent(self.samples) if self.bench.chance else certain(self.samples[0])

    @property
    def amount(self) -> int:
        """How much has been sampled, in what :meth:`more` counts."""
        return len(self.rows)

    @property
    def price(self) -> float:
        """Of one sample, in substeps."""
        return self.plan.settings.substeps * self.plan.frames

    def above(self, other: Level) -> Mean:
        """By how much it lies above another, seed by seed."""
        count = min(self.amount, other.amount)
        change = self.samples[:count] - other.samples[:count]
        return independent(change) if self.bench.chance else certain(change[0])

    def covariance(self, other: Level, coarse: Level) -> float:
        """Of the mean with that of ``other.above(coarse)``: they may share samples."""
        count = min(other.amount, coarse.amount, self.amount)
        if count < 2:
            return 0.0
        change = other.samples[:count] - coarse.samples[:count]
        return float(np.cov(self.samples[:count], change)[0, 1]) / self.amount

    def _reduced(self, row: np.ndarray) -> float:
        times = self.plan.settings.dt * np.arange(len(row))
        return self.bench.over(times[self.bench.start :], row[self.bench.start :])


class Series(Level):
    """One long run, whose mean over time is wanted; a sample is a run of the plan's frames."""

    def __init__(self, bench: Bench, plan: Plan, step: float):
        super().__init__(bench, plan, step)
        self.sim = bench.open(plan, [0])
        self.values = np.zeros(0)

    def more(self, count: int, part: str) -> None:
        wanted = count * self.plan.frames + 1 - len(self.values)
        if len(self.values) == 0:
            wanted -= 1  # the start is there at once
        if wanted > 0:
            self.bench.say(part, self.plan, wanted)
            new = self.bench.advance(self.sim, wanted, part)
            self.values = np.append(self.values, new[:, 0])

    @property
    def samples(self) -> np.ndarray:
        return np.array([self.mean.value])

    @property
    def history(self) -> np.ndarray:
        return self.values

    @property
    def mean(self) -> Mean:
        return statistics.mean(self.values[self.bench.start :])

    @property
    def amount(self) -> int:
        return max(0, len(self.values) - 1) // self.plan.frames

    def above(self, other: Level) -> Mean:
        return statistics.difference(self.mean, other.mean)

    def covariance(self, other: Level, coarse: Level) -> float:
        return self.mean.error**2 * ((self is other) - (self is coarse))


def agree(levels: list[Level]) -> bool:
    """Whether the second change of three means may be no larger than the first."""
    first, second = (b.above(a) for a, b in itertools.pairwise(levels))
    excess = abs(second.value) - abs(first.value)
    return excess <= statistics.difference(second, first).reach()


def certain(value: float) -> Mean:
    """A mean of what has no chance in it."""
    return Mean(float(value), 0.0, math.inf, math.inf)


def enlarged(have: int, wanted: float) -> int:
    """How many samples to have next, on the way to those that are wanted."""
    return math.ceil(have + min(max(NEXT * (wanted - have), LEAST * have), GROWTH * have))


def needed(level: Level, reach: float, confidence: float) -> int:
    """How much of a level would have an interval reach so far; 1 where there is no chance."""
    if not level.mean.error:
        return 1
    one = level.mean.error * math.sqrt(level.amount)
    t = statistics.student(confidence, max(level.amount - 1, 1))
    return max(2, math.ceil((t * one / reach) ** 2))


def corrected(main: Mean, correction: Mean, covariance: float = 0.0) -> Mean:
    """The sum of a mean and a correction, which may share samples."""
    total = statistics.difference(main, dataclasses.replace(correction, value=-correction.value))
    error = math.sqrt(max(total.error**2 + 2.0 * covariance, 0.0))
    return dataclasses.replace(total, error=error, effective=main.effective)
