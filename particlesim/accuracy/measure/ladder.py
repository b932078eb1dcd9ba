"""Ladder: levels at finer and finer steps, until the limit of what is observed is known."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np

from ... import validate
from ...instruments.watchdog.incident import SimulationError
from ..statistics import Mean, independent, student
from .levels import FACTORS, PILOT, SAMPLES, Level, agree, certain, corrected, enlarged
from .over import OWNER
from .richardson import ROUNDING, Limit, limit

RUNGS = 12  # at most
SETTLING = 0.7  # of the change two refinements ago; more is no convergence, of any order
FALLING = 0.5  # of the variance of the changes before, if seeds converge: a quarter by first order
REMEDY = {
    "time": "allow a larger error, or observe what converges: of a chaotic scene only averages, "
    "over time or seeds, do",
    "space": "allow a larger error, or start from a finer one",
}


class Ladder:
    """Levels, the coarsest first, with the same seeds.

    Args:
        make: ``make(k)`` gives level k.
        part: What is refined: ``"time"`` or ``"space"``.
        nominal: Order to be expected, if there is one.
    """

    def __init__(self, make: Callable[[int], Level], part: str, nominal: float | None):
        self.make, self.part, self.nominal = make, part, nominal
        self.begin_anew()

    def begin_anew(self) -> None:
        """Forget all levels."""
        self.levels: list[Level] = []
        self.rungs, self.main, self.cause = 0, 0, ""

    def start(self) -> None:
        """The coarsest level that does not fail."""
        while not self.levels:
            self._check(0.0)
            self.add()

    def climb(self, share: float, allowed: float, confidence: float) -> tuple[Limit, Mean] | None:
        """Refine and sample until the limit is as sure as asked for; None where it is chaotic.

        Of a chaotic scene the last three levels are left, and no more.

        Args:
            share: What refining may leave unsure.
            allowed: What that and chance may be together.
            confidence: Of the interval.

        Raises:
            ValueError: It does not converge.
        """
        while True:
            if self.chaotic:
                self.levels = self.levels[-3:]
                return None
            found = self.limit
            if found.unsure > share:
                if self._hidden(confidence):
                    self._more(2 * self.shared)
                else:
                    self._check(share)
                    self.add()
                continue
            mean = self.value(found)
            if mean.reach(confidence) + found.unsure <= allowed:
                return found, mean
            self._sample(found, allowed, confidence)

    def add(self) -> None:
        """The next level. One that fails shows that those before it were not fine enough."""
        level, count = self.make(self.rungs), self.shared or PILOT
        self.rungs += 1
        try:
            level.more(count, self.part)
        except SimulationError as error:
            self.levels, self.cause = [], str(error)
        else:
            self.levels.append(level)

    @property
    def shared(self) -> int:
        """Seeds that all levels have."""
        return min((level.amount for level in self.levels), default=0)

    @property
    def values(self) -> np.ndarray:
        """The means of these seeds."""
        return np.array([level.samples[: self.shared].mean() for level in self.levels])

    @property
    def limit(self) -> Limit:
        """What the means tend to."""
        if not self.levels:
            return Limit(math.nan, math.inf, None, math.inf, math.inf)
        return limit([level.step for level in self.levels], self.values, self.nominal)

    @property
    def chaotic(self) -> bool:
        """Whether a seed goes another way at every step, while averages agree."""
        if self.part != "time" or len(self.levels) < 3 or not self.levels[0].bench.chance:
            return False
        x = np.array([level.samples[: self.shared] for level in self.levels[-3:]])
        changes = np.diff(x, axis=0).var(axis=1)
        nothing = (ROUNDING * np.abs(x).max()) ** 2
        wild = changes[1] > max(FALLING * changes[0], nothing)
        return bool(wild) and agree(self.levels[-3:])

    def value(self, found: Limit) -> Mean:
        """The limit: the mean of one level, of all its seeds, and what corrects it."""
        level, missing = self.levels[self.main], self._missing(found)[self.main]
        if not level.bench.chance:
            return certain(level.samples[0] + missing[0])
        shared = np.cov(level.samples[: len(missing)], missing)[0, 1]
        return corrected(level.mean, independent(missing), float(shared) / level.amount)

    def _missing(self, found: Limit) -> np.ndarray:
        """Limit less level, (levels, n), of each seed that all levels have."""
        x = np.array([level.samples[: self.shared] for level in self.levels])
        limits = x[-1]
        if found.order is not None:
            ratio = (self.levels[-2].step / self.levels[-1].step) ** found.order
            limits = limits + (x[-1] - x[-2]) / (ratio - 1.0)
        return limits - x

    def _hidden(self, confidence: float) -> bool:
        """Whether the last change cannot be told from none, by chance."""
        if len(self.levels) < 3 or not self.levels[0].bench.chance:
            return False
        change = self.levels[-1].above(self.levels[-2])
        if 2 * self.shared > SAMPLES:
            return False
        return 0.0 < abs(change.value) < change.reach(confidence)

    def _sample(self, found: Limit, allowed: float, confidence: float) -> None:
        """More seeds, of all levels and of one of them, as the interval asks for at least cost.

        Raises:
            ValueError: Nothing within reason would do.
        """
        missing, have = self._missing(found), self.shared
        prices = np.array([level.price for level in self.levels])
        aim = ((allowed - found.unsure) / student(confidence, have - 1)) ** 2
        best = (math.inf, 0, 0, 0)
        covariances = [
            np.cov(level.samples[:have], each)
            for level, each in zip(self.levels, missing, strict=True)
        ]
        for factor, (m, both) in itertools.product(FACTORS, enumerate(covariances)):
            all_of = math.ceil(have * factor)
            variance = aim - both[1, 1] / all_of
            if variance <= 0:
                continue
            own = self.levels[m].mean.error ** 2 * self.levels[m].amount
            wanted = max(all_of, math.ceil((own + 2.0 * both[0, 1]) / variance))
            more = max(wanted - max(self.levels[m].amount, all_of), 0)
            price = (all_of - have) * prices.sum() + more * prices[m]
            if price < best[0] and wanted <= SAMPLES:
                best = (price, m, all_of, wanted)
        if not best[3]:
            raise validate.fail(
                OWNER, "chance", f"fall to {allowed:.3g} within {SAMPLES} seeds",
                self.value(found).error, "allow a larger error",
            )  # fmt: skip
        _, self.main, all_of, wanted = best
        if all_of > have:
            self._more(enlarged(have, all_of))
        level = self.levels[self.main]
        level.more(enlarged(level.amount, wanted), "chance")
        level.bench.leave_out(level.history)

    def _more(self, count: int) -> None:
        """Seeds of all levels."""
        for level in self.levels:
            level.more(count, "chance")

    def _check(self, share: float) -> None:
        """Refuse to go on where it leads nowhere."""
        changes = np.abs(np.diff(self.values)) if self.levels else np.zeros(0)
        stuck = len(changes) > 4 and changes[-1] > SETTLING * changes[-3] > 0.0
        if stuck or self.rungs >= RUNGS:
            got = ", ".join(f"{change:.3g}" for change in changes[-4:])
            raise validate.fail(
                OWNER, self.part, f"converge to {share:.3g}",
                f"changes of {got}" if got else self.cause, REMEDY[self.part],
            )  # fmt: skip
