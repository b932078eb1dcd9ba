"""The search: the least substeps of one mode after the other, each only while it may be cheaper."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from ...engine.integrators import METHODS
from .bench import Bench
from .report import Trial

BETTER = 0.95  # of the cost of the best: below it another setting counts as cheaper
FLOOR = 0.8  # of the error at a quarter of the substeps; what falls less has reached its floor
STRIDE = 4.0  # largest jump in substeps, up or down
RESOLUTION = 1.1  # between substeps that are told apart
WEIGHINGS = 3  # runs of each that its weight is the least of


class Search:
    """The cheapest trial whose error, that of another seed too, is at most ``target``.

    Error falls with substeps, and cost is proportional to them: so the least substeps that suffice
    are found by the secant of the logarithms, and of another mode (integrator, precision,
    iterations, an option of ``build``) first that number is tried at which it would cost what the
    best costs. If that does not suffice, all of the mode is dominated, for the price of a trial.

    What a substep of a mode costs is measured once and in turn with the others, for every value of
    a knob beside the first of the others: so a noisy machine does not send the search astray.

    Args:
        bench: Tries settings.
        target: The error to stay under.
        ladders: Values of each knob but the substeps; the first are tried first.
        levels: Substeps to choose from, rising.
        weights: What a substep costs by (knob, value), where that has been measured before.
    """

    def __init__(
        self,
        bench: Bench,
        target: float,
        ladders: Mapping[str, Sequence[Any]],
        levels: Sequence[int],
        weights: dict[tuple[str, str], float] | None = None,
    ):
        self.bench, self.target, self.ladders, self.levels = bench, target, ladders, levels
        self.best: Trial | None = None
        self.mode = {name: values[0] for name, values in ladders.items()}
        self.weights = {} if weights is None else weights

    def run(self, start: int) -> Trial | None:
        """Search from about ``start`` substeps; None if nothing suffices."""
        level = self._level(start)
        if not self.weights:
            self._weigh(level)
        self.mode = self._promising(level)
        self._least(self.mode, level, len(self.levels) - 1)
        changed = True
        while changed:
            changed = False
            for name, values in self.ladders.items():
                for value in values:
                    mode = {**self.mode, name: value}
                    if value != self.mode[name] and self._improve(mode):
                        self.mode, changed = mode, True
        return self.best

    def _promising(self, level: int) -> dict[str, Any]:
        """The mode of the integrator that should do with least, by its order, to start from.

        The wrong one may need a thousand times the substeps before another is tried.
        """
        prices = {}
        for integrator in self.ladders.get("integrator", ()):
            mode = {**self.mode, "integrator": integrator}
            trial = self.bench.trial({**mode, "substeps": self.levels[level]})
            excess = max(trial.bound / self.target, 1e-6)
            prices[integrator] = self.price(trial.values) * excess ** (1.0 / self._order(mode, {}))
        if not prices:
            return self.mode
        return {**self.mode, "integrator": min(prices, key=lambda name: prices[name])}

    def price(self, values: Mapping[str, Any]) -> float:
        """What settings cost, but for a factor that all share."""
        weights = (self.weights[name, repr(values[name])] for name in self.ladders)
        return values["substeps"] * math.prod(weights)

    def _weigh(self, level: int) -> None:
        """Measure the weight of every value of every knob."""
        modes = [self.mode]
        names = [("", None)]
        for name, values in self.ladders.items():
            self.weights[name, repr(values[0])] = 1.0
            modes += [{**self.mode, name: value} for value in values[1:]]
            names += [(name, value) for value in values[1:]]
        if len(modes) == 1:
            return
        substeps = self.levels[level]
        costs = self.bench.costs([{**mode, "substeps": substeps} for mode in modes], WEIGHINGS)
        for (name, value), cost in zip(names[1:], costs[1:], strict=True):
            self.weights[name, repr(value)] = cost / costs[0]

    # One mode -----------------------------------------------------------------------------------

    def _improve(self, mode: dict[str, Any]) -> bool:
        """Find the least substeps of a mode if they may be cheaper than the best."""
        if self.best is None:
            self._least(mode, len(self.levels) // 2, len(self.levels) - 1)
            return self.best is not None
        before = self.best
        even = BETTER * self.price(before.values) / self.price({**mode, "substeps": 1})
        highest = self._level(even, below=True)
        same = min(highest, self._level(before.values["substeps"]))
        for level in sorted({same, highest}):
            if level >= 0 and self._suffices(mode, level):
                self._least(mode, level, level)
                break
        return self.best is not before

    def _least(self, mode: dict[str, Any], start: int, highest: int) -> None:
        """The least level that suffices, between those that bracket it."""
        low, high, at = -1, highest + 1, start
        seen: dict[int, float] = {}
        while low + 1 < high:
            seen[at] = self.bench.trial({**mode, "substeps": self.levels[at]}).bound
            if self._suffices(mode, at):
                high = at
            elif self._stuck(seen, at):
                return
            else:
                low = at
            if high in seen and low in seen and self._close(low, high):
                return
            if low + 1 < high:
                at = self._next(mode, seen, at, low, high)

    def _next(
        self, mode: dict[str, Any], seen: Mapping[int, float], at: int, low: int, high: int
    ) -> int:
        """Where the error should meet the target, within the bracket and not too far away."""
        if low in seen and high in seen and len(seen) > 4:
            return (low + high) // 2  # the secant had its chance
        error = seen[at]
        if 0.0 < error < math.inf:
            ratio = (error / self.target) ** (1.0 / self._order(mode, seen))
        else:
            ratio = STRIDE if error else 1.0 / STRIDE
        level = self._level(self.levels[at] * min(max(ratio, 1.0 / STRIDE), STRIDE))
        return min(max(level, low + 1), high - 1)

    def _order(self, mode: Mapping[str, Any], seen: Mapping[int, float]) -> float:
        """Order of convergence, by the two errors nearest to the target, or of the method."""
        usable = [(self.levels[at], error) for at, error in seen.items() if 0 < error < math.inf]
        usable.sort(key=lambda point: abs(math.log(point[1] / self.target)))
        if len(usable) > 1:
            (s0, e0), (s1, e1) = usable[:2]
            return min(max(math.log(e0 / e1) / math.log(s1 / s0), 0.5), 4.0)
        return float(METHODS[mode["integrator"]].order) if "integrator" in mode else 1.0

    def _stuck(self, seen: Mapping[int, float], at: int) -> bool:
        """More substeps have stopped to help, or there are none."""
        coarser = [
            error
            for level, error in seen.items()
            if self.levels[level] * STRIDE <= self.levels[at] * RESOLUTION
        ]
        stopped = bool(coarser) and FLOOR * min(coarser) < seen[at] < math.inf
        return stopped or at == len(self.levels) - 1

    def _close(self, low: int, high: int) -> bool:
        return high - low == 1 or self.levels[high] <= RESOLUTION * self.levels[low]

    def _suffices(self, mode: Mapping[str, Any], level: int) -> bool:
        """Whether the error is small enough; it is kept if that makes it the best."""
        trial = self.bench.trial({**mode, "substeps": self.levels[level]})
        if trial.bound > self.target:
            return False
        if self.best is None or self.price(trial.values) < self.price(self.best.values):
            self.best = trial
        return True

    def _level(self, substeps: float, *, below: bool = False) -> int:
        """The level nearest in ratio; ``below``: the highest that is not above, or -1."""
        if below:
            return max((k for k, each in enumerate(self.levels) if each <= substeps), default=-1)
        nearness = [abs(math.log(each / max(substeps, 1e-9))) for each in self.levels]
        return nearness.index(min(nearness))


def levels(least: int, most: int) -> list[int]:
    """Whole numbers from ``least`` to about ``most``, each about a tenth above the last."""
    found = [least]
    while found[-1] < most:
        found.append(max(found[-1] + 1, round(found[-1] * RESOLUTION)))
    return found
