"""Spending: the least error that a given time buys."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from .bench import Bench
from .report import Trial

SAFE = 0.9  # of the time that is planned with, as no machine is always as fast
SHARES = (4, 2)  # of the substeps that can be had: those from which the error is foretold
CORRECTIONS = 3  # of the substeps, where the run turns out to be dearer


class Spend:
    """The trial of the least error among those that cost no more than ``cost``.

    What a frame costs is a + b substeps, measured of every mode; so many substeps can be had. What
    error they have is foretold from a quarter and half of them, and only the most promising mode is
    tried in full.

    Args:
        bench: Tries settings.
        cost: Wall seconds per simulated second that may be spent.
        ladders: Values of each knob but the substeps; the first are tried first.
        least: Substeps below which it is not stable.
    """

    def __init__(self, bench: Bench, cost: float, ladders: Mapping[str, Sequence[Any]], least: int):
        self.bench, self.cost, self.ladders, self.least = bench, cost, ladders, least
        self.promises: dict[str, float] = {}
        self.prices: dict[str, tuple[float, float]] = {}

    def run(self, start: int) -> Trial | None:
        """Choose a mode, from about ``start`` substeps; None if nothing can be had for the cost."""
        self.start = max(start, self.least)
        mode = {name: values[0] for name, values in self.ladders.items()}
        for name, values in self.ladders.items():
            mode[name] = min(values, key=lambda value: self._promise({**mode, name: value}))
        return self._spent(mode)

    def _most(self, mode: Mapping[str, Any]) -> int:
        """The substeps that can be had."""
        key = repr(mode)
        if key not in self.prices:
            few, many = self.start, 2 * self.start
            low, high = self.bench.costs([{**mode, "substeps": n} for n in (few, many)], 2)
            each = max((high - low) / (many - few), 0.25 * low / few)
            self.prices[key] = max(low - few * each, 0.0), each
        frame, substep = self.prices[key]
        return int((SAFE * self.cost - frame) / substep) if math.isfinite(substep) else 0

    def _promise(self, mode: Mapping[str, Any]) -> float:
        """The error to be expected for the cost; infinite where nothing stable can be had."""
        key = repr(mode)
        if key not in self.promises:
            most = self._most(mode)
            self.promises[key] = math.inf
            if most >= self.least:
                steps = [max(most // share, self.least) for share in SHARES]
                coarse, fine = (
                    self.bench.trial({**mode, "substeps": n}).bound for n in steps
                )  # fmt: skip
                falls = 0.0 < fine < coarse < math.inf
                self.promises[key] = fine * fine / coarse if falls else fine
        return self.promises[key]

    def _spent(self, mode: Mapping[str, Any]) -> Trial | None:
        """The best trial of a mode that costs no more, once it is measured."""
        most = self._most(mode)
        for _ in range(CORRECTIONS):
            if most < self.least:
                return None
            (cost,) = self.bench.costs([{**mode, "substeps": most}], 2)
            if cost <= self.cost:
                break
            most = int(most * SAFE * self.cost / cost)
        self.bench.trial({**mode, "substeps": most})
        affordable = [
            each
            for each in self.bench.trials
            if each.values["substeps"] <= most
            and all(each.values[name] == value for name, value in mode.items())
        ]
        best = min(affordable, key=lambda trial: trial.bound)
        return best if math.isfinite(best.bound) else None
