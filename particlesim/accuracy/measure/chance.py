"""Chance: averages of chaotic scenes, whose levels agree only within their errors.

A fine level's mean is corrected by what two coarse ones say of the step's part in it,
bias(h) = c h^p: what they differ by falls by 2^p with each level, and their chance with it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

from ... import validate
from ..statistics import Mean, student
from .levels import FACTORS, PILOT, SAMPLES, Level, agree, corrected, enlarged
from .over import OWNER
from .richardson import LEAST

HALF = 0.5  # of a correction is made, as averages may converge at a higher order than positions
DOUBT = 0.6  # of a correction is left unsure: so that all of it, and none, are within
FINEST = 8  # level, at most
REMEDY = "allow a larger error, or observe another average"
AGREE = 4.0  # standard errors by which averages at two levels may differ


@dataclass(frozen=True)
class Average:
    """An average, and what a plain run would need.

    Args:
        mean: The corrected one.
        unsure: How far off the correction may be.
        level: Whose mean it was.
        bias: Of that level.
        order: By which the bias falls.
    """

    mean: Mean
    unsure: float
    level: Level
    bias: float
    order: float


class Averages:
    """Levels of a chaotic scene, from the coarsest on.

    Args:
        make: ``make(k)`` gives level k.
        levels: Those that there are, three.
        order: Of convergence, as found of short runs.
    """

    def __init__(self, make: Callable[[int], Level], levels: list[Level], order: float):
        self.make, self.levels, self.order = make, levels, order
        self.next = len(levels)

    def settle(self) -> None:
        """Hold the order against how the changes of three levels fall, from where they do.

        Raises:
            ValueError: They never do.
        """
        while True:
            while math.inf in (each.mean.error for each in self.levels):
                self._check_samples(2 * self.levels[0].amount)
                for level in self.levels:
                    level.more(2 * level.amount, "chance")
            one, two = (b.above(a) for a, b in itertools.pairwise(self.levels))
            if agree(self.levels):
                break
            if self.next > FINEST:
                raise validate.fail(
                    OWNER, "time", "converge",
                    f"changes of averages of {one.value:.3g}, {two.value:.3g}", REMEDY,
                )  # fmt: skip
            self.levels = [*self.levels[1:], self._finer()]
            self.levels[-1].more(self.levels[0].amount, "time")
        if all(abs(each.value) > each.reach() for each in (one, two)):
            found = math.log2(max(abs(one.value / two.value), 1.0))
            self.order = min(self.order, max(found, LEAST))

    def find(self, allowed: float, confidence: float) -> Average:
        """Sample until the interval is small enough.

        Raises:
            ValueError: It would take too many samples, or levels contradict each other.
        """
        while True:
            pilot, index, wanted = self._plan(allowed, confidence)
            for level in self.levels[:2]:
                level.more(enlarged(level.amount, pilot) if pilot > level.amount else 0, "time")
            while len(self.levels) <= index:
                self.levels.append(self._finer())
            level = self.levels[index]
            level.more(enlarged(level.amount or PILOT, wanted), "chance")
            level.bench.leave_out(level.history)
            found = self._average(level)
            if found.mean.reach(confidence) + found.unsure <= allowed:
                self._compare(found)
                return found

    def _finer(self) -> Level:
        """The next level."""
        self.next += 1
        return self.make(self.next - 1)

    def _check_samples(self, count: int) -> None:
        if count > SAMPLES:
            raise validate.fail(
                OWNER, "chance", f"be told from {SAMPLES} samples", "more", "observe what settles"
            )

    def step_for(self, bias: float, confidence: float) -> float:
        """The step whose bias is no larger than that, for all that chance may hide."""
        change, level = self.levels[1].above(self.levels[0]), self.levels[1]
        most = self._weight(level) * (abs(change.value) + change.reach(confidence))
        return level.step * (bias / most) ** (1.0 / self.order) if most else level.step

    def _weight(self, level: Level) -> float:
        """The part of the difference of the first two levels that is missing at one of them."""
        h0, h1 = (each.step**self.order for each in self.levels[:2])
        return level.step**self.order / (h0 - h1)

    def _average(self, level: Level) -> Average:
        coarse, fine = self.levels[:2]
        change, weight = fine.above(coarse), self._weight(level)
        part = HALF * weight
        correction = Mean(part * change.value, part * change.error, change.degrees, 0.0)
        mean = corrected(level.mean, correction, part * level.covariance(fine, coarse))
        bias = weight * abs(change.value)
        return Average(mean, DOUBT * bias, level, bias, self.order)

    def _plan(self, allowed: float, confidence: float) -> tuple[int, int, int]:
        """Samples of the first two levels, the level to sample, and how many there: the cheapest.

        Raises:
            ValueError: Nothing within reason would do.
        """
        coarse, fine = self.levels[:2]
        have = min(coarse.amount, fine.amount)
        change = fine.above(coarse)
        one = max(coarse.mean.error**2 * coarse.amount, fine.mean.error**2 * fine.amount)
        shared = [level.amount * level.covariance(fine, coarse) for level in (coarse, fine)]
        shared += [0.0] * FINEST
        best = (math.inf, 0, 0, 0)
        for factor, index in itertools.product(FACTORS, range(FINEST)):
            pilot = math.ceil(have * factor)
            weight = self._weight(coarse) * (fine.step / coarse.step) ** (index * self.order)
            left = allowed - DOUBT * weight * abs(change.value)
            t = student(confidence, pilot - 1 if coarse.bench.chance else change.degrees)
            part = HALF * weight
            variance = (left / t) ** 2 - (part * change.error) ** 2 * have / pilot
            if left <= 0 or variance <= 0:
                continue
            wanted = math.ceil((one + 2.0 * part * shared[index]) / variance)
            wanted = max(wanted, pilot if index < 2 else 2)
            got = pilot if index < 2 else 0
            if index < len(self.levels):
                got = max(got, self.levels[index].amount)
            price = 3.0 * (pilot - have) + 2.0**index * max(wanted - got, 0)
            if max(wanted, pilot) <= SAMPLES and price < best[0]:
                best = (price, pilot, index, wanted)
        if not best[3]:
            raise validate.fail(
                OWNER, "chance", f"fall to {allowed:.3g} within {SAMPLES} samples",
                max(coarse.mean.reach(confidence), fine.mean.reach(confidence)),
                "allow a larger error, or give more frames",
            )  # fmt: skip
        return best[1:]

    def _compare(self, found: Average) -> None:
        """Averages at two levels agree within their errors, or the order is not what it seems."""
        other = self._average(self.levels[1])
        if found.level in self.levels[:2]:
            return
        gap = abs(found.mean.value - other.mean.value) - found.unsure - other.unsure
        spread = math.hypot(found.mean.error, other.mean.error)
        if gap > AGREE * spread:
            raise validate.fail(
                OWNER, "time", f"converge at order {self.order:g} as short runs do",
                f"averages {gap / spread:.2g} standard errors apart at two steps", REMEDY,
            )  # fmt: skip
