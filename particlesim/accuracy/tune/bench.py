"""The bench: tries settings, and remembers what became of them."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ..judges import Judge
from ..judging import choose_judge, measure
from ..reference import Reference
from ..run import Run
from ..study import SEED, Study
from .along import Along
from .report import Trial

ENOUGH = 0.02  # seconds of each setting that is weighed, of which the least repeat counts


class Bench:
    """Tries settings.

    Args:
        study: The scene, with its seeds, over the time that is looked at.
        by, observe, over: What the error is, as for :func:`particlesim.tradeoff`; ``by`` may also
            be an :class:`Along`, which knows at which times an answer holds.
        reference: What it is compared with, or None.
        margin: Part of the tolerance to stay under at the end.
        show: Called with every trial as it is done.
    """

    def __init__(
        self,
        study: Study,
        by: Any,
        reference: Reference | np.ndarray | None = None,
        observe: Any = None,
        over: str | None = None,
        margin: float = 1.0,
        show: Callable[[Trial], None] | None = None,
    ):
        self.study, self.by, self.reference, self.margin = study, by, reference, margin
        self.observe, self.over, self.show = observe, over, show
        self.words = self.device = ""
        self._known: dict[str, Trial] = {}

    @property
    def trials(self) -> list[Trial]:
        """All that were tried, in order."""
        return list(self._known.values())

    def trial(self, values: Mapping[str, Any]) -> Trial:
        """The error and the cost of some knobs and options; tried once."""
        key = repr(sorted(values.items()))
        if key not in self._known:
            self._known[key] = self._tried(values)
            if self.show is not None:
                self.show(self._known[key])
        return self._known[key]

    def _tried(self, values: Mapping[str, Any]) -> Trial:
        run = Run(self.study, self.study.plan(values))
        judge = self._judge(run)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of errors that are not finite: they count
            measure([run], judge, 1, least=0.0)
        self.words, self.device = judge.describe(), str(run.sim.device)
        failed = bool(run.cause) or not all(math.isfinite(each) for each in run.errors)
        trial = Trial(
            values=dict(values),
            settings=run.plan.settings,
            options={name: value for name, value in run.plan.options.items() if name != SEED},
            error=math.inf if failed else max(run.errors),
            cost=min(run.costs, default=math.inf),
            cause=run.cause,
            spread=0.0 if failed else max(run.errors) - min(run.errors),
            series=run.notes.get("along"),
        )
        return self.by.bounded(trial, self.margin) if isinstance(self.by, Along) else trial

    def _judge(self, run: Run) -> Judge:
        if isinstance(self.by, Along):
            return self.by
        return choose_judge(
            self.study, [run.plan], self.by, self.reference, self.observe, self.over
        )

    def look_again(self) -> None:
        """Bound all trials anew, at the times at which the answer is now known to hold."""
        for key, trial in self._known.items():
            self._known[key] = self.by.bounded(trial, self.margin)

    def costs(self, chosen: Sequence[Mapping[str, Any]], repeats: int) -> list[float]:
        """Wall seconds per simulated second, measured in turn; the least, as disturbance adds.

        Infinite where it fails.
        """
        alone = self.study.alone()
        runs = [Run(alone, alone.plan(values)) for values in chosen]
        measure(runs, Judge(), repeats, least=ENOUGH)
        return [min(run.costs) if run.costs and not run.cause else math.inf for run in runs]
