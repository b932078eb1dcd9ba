"""Bench: tries settings on every seed, and says what they cost and how far off they are."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ..judges import Judge
from ..judging import choose_judge, measure
from ..run import Run
from ..study import SEED, Study
from .report import Trial


class Bench:
    """Tries settings.

    Args:
        studies: The scene, once a seed.
        by: What the error is, as for :func:`particlesim.tradeoff`.
        references: What each study is compared with, positions or None.
        show: Called with every trial as it is done.
    """

    def __init__(
        self,
        studies: Sequence[Study],
        by: Any,
        references: Sequence[np.ndarray | None],
        show: Callable[[Trial], None] | None = None,
    ):
        self.studies, self.by, self.references, self.show = studies, by, references, show
        self.trials: list[Trial] = []
        self.words = self.device = ""
        self._known: dict[str, Trial] = {}

    def trial(self, values: Mapping[str, Any]) -> Trial:
        """The error and the cost of some knobs and options; tried once."""
        key = repr(sorted(values.items()))
        if key not in self._known:
            self._known[key] = self._tried(values)
            self.trials.append(self._known[key])
            if self.show is not None:
                self.show(self._known[key])
        return self._known[key]

    def _tried(self, values: Mapping[str, Any]) -> Trial:
        runs = []
        for study, reference in zip(self.studies, self.references, strict=True):
            run = Run(study, study.plan(values))
            judge = choose_judge(study, [run.plan], self.by, reference)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of errors that are not finite: they count
                measure([run], judge, 1)
            self.words, self.device = judge.describe(), str(run.sim.device)
            runs.append(run)
            if run.cause:
                break  # once is enough to be out
        # All do the same work; what disturbs only slows.
        cost = min((min(run.costs) for run in runs if run.costs), default=math.inf)
        plan = runs[0].plan
        failed = [bool(run.cause) or not math.isfinite(run.error) for run in runs]
        errors = [math.inf if bad else run.error for bad, run in zip(failed, runs, strict=True)]
        return Trial(
            values=dict(values),
            settings=plan.settings,
            options={name: value for name, value in plan.options.items() if name != SEED},
            error=max(errors),
            cost=cost,
            cause=next((run.cause for run in runs if run.cause), ""),
            spread=max(errors) - min(errors) if math.isfinite(max(errors)) else 0.0,
        )

    def costs(self, chosen: Sequence[Mapping[str, Any]], repeats: int) -> list[float]:
        """Wall seconds per simulated second, measured in turn; the least, as disturbance adds.

        Infinite where it fails.
        """
        study = self.studies[0]
        runs = [Run(study, study.plan(values)) for values in chosen]
        measure(runs, Judge(), repeats)
        return [min(run.costs) if run.costs and not run.cause else math.inf for run in runs]
