"""Bench: tries settings on every seed, and says what they cost and how far off they are."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ..tradeoff.judges import Judge
from ..tradeoff.plan import Study
from ..tradeoff.run import Run
from ..tradeoff.sweep import choose_judge, measure
from .report import Trial, finite

SEED = "seed"  # the option of build that makes another of the same kind


class Bench:
    """Tries settings.

    Args:
        studies: The scene, once a seed.
        by: What the error is, as for :func:`particlesim.accuracy.tradeoff`.
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
        self.words = ""
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
            plan = study.plan(values)
            run = Run(plan, study.simulation(plan))
            judge = choose_judge(study, [plan], self.by, reference)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of errors that are not finite: they count
                measure([run], judge, 1, None)
            self.words = judge.describe()
            runs.append(run)
            if run.cause:
                break  # once is enough to be out
        # All do the same work; what disturbs only slows.
        cost = min((min(run.costs) for run in runs if run.costs), default=math.inf)
        plan = runs[0].plan
        errors = [math.inf if run.cause else finite(run.error) for run in runs]
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
        runs = []
        for values in chosen:
            plan = study.plan(values)
            runs.append(Run(plan, study.simulation(plan)))
        measure(runs, Judge(), repeats, None)
        return [min(run.costs) if run.costs and not run.cause else math.inf for run in runs]


def with_seeds(
    study: Callable[[dict[str, Any]], Study], options: Mapping[str, Any], seeds: int
) -> list[Study]:
    """Studies of the scene, one a seed where ``build`` has them and none is given."""
    first = study(dict(options))
    parameter = first.parameters.get(SEED)
    default = None if parameter is None else parameter.default
    if SEED in options or not isinstance(default, int):
        return [first]
    return [first, *(study({**options, SEED: default + k}) for k in range(1, seeds))]
