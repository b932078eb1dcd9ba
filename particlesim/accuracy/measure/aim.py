"""Aim: what is to be measured how well, and the first step to try."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np

from ..study import Plan
from .bench import Bench
from .levels import Level, Series
from .richardson import ROUNDING, found_order

UNLIMITED = 8  # of the settings' substeps: where to start where nothing limits them
SHORT = 2  # frames, at most, in which positions show the order
FINE = (2, 3, 4)  # levels, likewise
NEAR = 0.15  # by which an order may miss a whole number, to be taken for it


class Aim:
    """A number, the error and confidence that are wanted, and the coarsest step.

    ``coarsest`` is the fewest substeps a frame within the limit of stability; ``nominal`` the order
    of the integrator.
    """

    def __init__(self, bench: Bench, error: float, confidence: float):
        self.bench, self.error, self.confidence = bench, error, confidence
        settings = bench.study.settings
        sim = bench.study.simulation(bench.study.plan({}))
        self.nominal = float(sim.integrator.order)
        report = sim.stability()
        self.coarsest = (
            int(report.substeps)
            if report.binding is not None and math.isfinite(report.substeps)
            else max(1, settings.substeps // UNLIMITED)
        )

    def plan(self, substeps: int, **values: Any) -> Plan:
        """Of so many substeps, in float64."""
        values = {"precision": "float64", "substeps": substeps, **values}
        return self.bench.study.plan(values, "options")

    def level(self, k: int) -> Level:
        """The k-th refinement in time: substeps doubled k times."""
        return self.level_of(self.plan(self.coarsest * 2**k))

    def level_of(self, plan: Plan) -> Level:
        """A level in time, of samples or of one long run."""
        kind = Series if self.bench.steady and not self.bench.chance else Level
        return kind(self.bench, plan, plan.settings.substep)

    def order(self) -> float:
        """The order at which positions converge in a few frames, in which chaos has no time.

        At most the nominal one: one that seems higher does so by accident.
        """
        frames = min(SHORT, self.bench.study.frames)
        ends = []
        for k in FINE:
            sim = self.bench.open(self.plan(self.coarsest * 2**k), [0])
            for _ in range(frames):
                self.bench.step(sim, "time")
            sim.close()
            ends.append(sim.state.unwrapped())
        moved = [((b - a) ** 2).sum(axis=1) for a, b in itertools.pairwise(ends)]
        changes = np.array([np.sqrt(each.mean()) for each in moved])
        if changes[1] <= ROUNDING * float(np.abs(ends[-1]).max(initial=0.0)):
            return self.nominal
        p = found_order(np.array([4.0, 2.0, 1.0]), changes) or 1.0
        p = float(round(p)) if abs(p - round(p)) < NEAR else p
        return min(max(p, 0.5), self.nominal)
