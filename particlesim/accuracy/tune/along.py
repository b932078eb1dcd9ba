"""Known answers along a run: an error of the end that passes through zero is no small error."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..judges import Judge
from ..one_world import worlds_of
from ..run import Run
from .report import Trial

LOOKS = 14  # at a run, beside its end and the end of what is longer
FALLEN = 0.5  # of the error that must be gone with finer steps, where the answer is known


class Along(Judge):
    """A function of the simulation that is the error at the end of a run, and perhaps before.

    Some answers are known at any time, some at the end only: those of the first kind fall along
    the run where steps are finer. :meth:`learn` finds out at which times they do, and from then on
    the error counts there too.

    Args:
        function: ``error(sim) -> float``.
        frames: Of the run.
        longer: Of a run that is somewhat longer, and is looked at.
    """

    name = "known"
    watches = True

    def __init__(self, function: Callable[[Any], float], frames: int, longer: int):
        self.function, self.frames = function, frames
        golden = (np.arange(1, LOOKS + 1) * 0.6180339887498949) % 1.0
        chosen = {max(1, round(part * frames)) for part in golden} | {frames, longer}
        self.at = sorted(chosen)
        self.valid = np.array([frame == frames for frame in self.at])
        self.inside = np.array([frame <= frames for frame in self.at])

    def watch(self, run: Run) -> None:
        frame = run.judged.frame
        if frame == 0:
            run.notes["along"] = []
        elif frame in self.at:
            run.notes["along"].append([self._value(each, frame) for each in worlds_of(run.judged)])

    def _value(self, sim: Any, frame: int) -> float:
        """The error; nan where the answer is not known, which some functions say by failing."""
        with np.errstate(all="ignore"):
            try:
                return abs(float(self.function(sim)))
            except Exception:
                if frame == self.frames:
                    raise
                return math.nan

    def finish(self, run: Run) -> None:
        run.notes["along"] = np.array(run.notes["along"])
        run.settle(run.notes["along"][self.at.index(self.frames)])

    def bounded(self, trial: Trial, margin: float) -> Trial:
        """A trial with the error that counts at all times at which the answer is known.

        It is the largest of all of them. Of several seeds the margin is for the end: before it is
        enough to be within the tolerance, and after it with nothing on top for yet another seed.
        """
        series = trial.series
        if trial.cause or series is None or len(series) < len(self.at):
            return trial
        end = series[self.at.index(self.frames)]
        before, after = series[self.valid & self.inside], series[self.valid & ~self.inside]
        if not np.isfinite(np.concatenate([before, after])).all():
            return dataclasses.replace(trial, limit=math.inf, along=math.inf)
        spare = margin if series.shape[1] > 1 else 1.0
        widest = float((2 * before.max(axis=1) - before.min(axis=1)).max())
        parts = [2 * end.max() - end.min(), spare * widest, spare * after.max(initial=0.0)]
        return dataclasses.replace(trial, limit=float(max(parts)), along=float(before.max()))

    def learn(self, coarse: Trial, fine: Trial, tolerance: float) -> bool:
        """Find the times at which the answer is known, by a run and a finer one.

        Returns:
            Whether there are any that were not known before.
        """
        if coarse.series is None or fine.series is None or len(fine.series) < len(self.at):
            return False
        was, now = coarse.series.max(axis=1), fine.series.max(axis=1)
        with np.errstate(all="ignore"):
            found = np.isfinite(was + now) & ((now <= tolerance) | (now <= FALLEN * was))
        new = found & ~self.valid
        self.valid |= found
        return bool(new.any())

    def describe(self) -> str:
        return "against the known answer"
