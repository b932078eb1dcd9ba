"""Errors of runs: a known answer, or conservation drift."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .one_world import worlds_of
from .run import Run
from .series import WORDS


class Judge:
    """Gives every run its error.

    ``name`` says what the error is; ``bound`` is the error beyond which a run counts as diverged
    unless the caller states another; ``over`` how an error that is looked at over time becomes one
    number. ``watches``: it looks at every frame of what is judged. ``scale`` is what errors are to
    be compared with, ``floor`` how far off what they are measured by may itself be, ``conserved``
    whether the error is of what a right run would keep.
    """

    name = ""
    bound = math.inf
    watches = False
    over = "final"
    scale = math.nan
    floor = 0.0
    conserved = False

    def check(self, runs: Sequence[Run]) -> None:
        """Before anything runs: refuse runs that cannot be judged."""

    def watch(self, run: Run) -> None:
        """At the start and after every frame of what is judged."""

    def finish(self, run: Run) -> None:
        """At the end of what is judged."""

    def judge(self, runs: Sequence[Run]) -> None:
        """Set the error of all runs that have not diverged, when all have run."""

    def describe(self) -> str:
        """The error in words, for reports."""
        return self.name


class Known(Judge):
    """The error is a function of the simulation, at its end or over time."""

    name = "known"

    def __init__(self, function: Callable[[Any], float], over: str = "final"):
        self.function, self.over, self.watches = function, over, over != "final"

    def _now(self, run: Run) -> np.ndarray:
        with np.errstate(all="ignore"):
            return np.array([float(self.function(each)) for each in worlds_of(run.judged)])

    def watch(self, run: Run) -> None:
        if run.judged.frame == 0:
            run.notes["errors"] = []
        else:
            run.notes["errors"].append(self._now(run))

    def finish(self, run: Run) -> None:
        run.notes["ended"] = True
        seen = np.array(run.notes["errors"] if self.watches else [self._now(run)])
        run.settle(over_time(seen, self.over))
        if not math.isfinite(run.error):
            run.cause = f"error must be finite, got {run.error} at t = {run.judged.time:g}"

    def judge(self, runs: Sequence[Run]) -> None:
        ended = [run for run in runs if run.notes.get("ended")]
        if ended and all(run.cause for run in ended):
            warnings.warn(
                f"{ended[0].study.owner}: error must be finite for one setting at least, got "
                f"{ended[0].error} for all that reached t = {ended[0].judged.time:g}; choose "
                "frames for which the answer is known, or another error.",
                stacklevel=5,
            )

    def describe(self) -> str:
        return "against the known answer" + over_words(self.over)


class Drift(Judge):
    """The change of a conserved quantity, over what the motion amounts to.

    The scale is that of the run that drifts least, so that it is the same for all, and one that
    explodes does not excuse itself.
    """

    bound = 10.0
    conserved = True
    watches = True

    def __init__(self, over: str = "max"):
        self.over = over

    def watch(self, run: Run) -> None:
        if run.judged.frame == 0:
            run.notes.update(changes=[], kinetic=0.0)
        with np.errstate(all="ignore"):
            now = run.judged.diagnostics()
            value = self.quantity(now)
            if run.judged.frame == 0:
                run.notes["start"] = value
            else:
                change = value - run.notes["start"]
                run.notes["changes"].append(change.reshape(len(value), -1))
            run.notes["kinetic"] = np.maximum(run.notes["kinetic"], now.kinetic)

    def finish(self, run: Run) -> None:
        with np.errstate(all="ignore"):
            changes = np.array(run.notes["changes"])
            if self.over == "mean":
                changes = changes.mean(axis=0, keepdims=True)
            size = np.linalg.norm(changes, axis=2)
            run.notes["change"] = over_time(size, "max" if self.over == "mean" else self.over)

    def judge(self, runs: Sequence[Run]) -> None:
        alive = [run for run in runs if not run.cause]
        if not alive:
            return
        best = min(
            alive, key=lambda run: float(np.nan_to_num(run.notes["change"], nan=1e300).max())
        )
        scale = self.size(best)
        for run in alive:
            change = run.notes["change"]
            # Where nothing moves there is nothing to compare with: any change is too much.
            ratio = np.where(change == 0, 0.0, np.inf)
            with np.errstate(all="ignore"):
                np.divide(change, scale, out=ratio, where=scale > 0)
            run.settle(ratio)

    def quantity(self, diagnostics: Any) -> np.ndarray:
        """What is conserved, one row a world."""
        raise NotImplementedError

    def size(self, run: Run) -> np.ndarray:
        """What it is compared with, one a world."""
        raise NotImplementedError


class EnergyDrift(Drift):
    """Change of the energy, over the largest kinetic energy."""

    name = "energy"

    def quantity(self, diagnostics: Any) -> np.ndarray:
        return diagnostics.energy

    def size(self, run: Run) -> np.ndarray:
        return run.notes["kinetic"]

    def describe(self) -> str:
        return "energy drift over the largest kinetic energy" + over_words(self.over)


class MomentumDrift(Drift):
    """Change of the momentum, over sqrt(2 m K): of all masses, at the largest K."""

    name = "momentum"

    def quantity(self, diagnostics: Any) -> np.ndarray:
        return diagnostics.momentum

    def size(self, run: Run) -> np.ndarray:
        mass = [float(scene.mass[~scene.pinned].sum()) for scene in run.judged.scenes]
        return np.sqrt(2.0 * np.array(mass) * run.notes["kinetic"])

    def describe(self) -> str:
        return "momentum drift over sqrt(2 m K)" + over_words(self.over)


@np.errstate(all="ignore")
def over_time(errors: np.ndarray, over: str) -> np.ndarray:
    """Errors (times, worlds) as one of each world, (worlds,), without signs."""
    if over == "mean":
        return np.abs(errors.mean(axis=0))
    size = np.abs(errors)
    if over == "max":
        return size.max(axis=0)
    return np.sqrt((size**2).mean(axis=0)) if over == "rms" else size[-1]


def over_words(over: str) -> str:
    """When an error is taken, where it is not at the end."""
    return "" if over == "final" else f", {WORDS[over]}"
