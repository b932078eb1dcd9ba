"""Errors of runs: a known answer, or conservation drift."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .run import Run


class Judge:
    """Gives every run its error.

    ``name`` says what the error is; ``bound`` is the error beyond which a run counts as diverged
    unless the caller states another. ``watches``: it looks at every frame of the first repeat.
    """

    name = ""
    bound = math.inf
    watches = False

    def check(self, runs: Sequence[Run]) -> None:
        """Before anything runs: refuse runs that cannot be judged."""

    def watch(self, run: Run) -> None:
        """At the start and after every frame of the first repeat."""

    def finish(self, run: Run) -> None:
        """At the end of the first repeat."""

    def judge(self, runs: Sequence[Run]) -> None:
        """Set the error of all runs that have not diverged, when all have run."""

    def describe(self) -> str:
        """The error in words, for reports."""
        return self.name


class Known(Judge):
    """The error is a function of the simulation at its end."""

    name = "known"

    def __init__(self, function: Callable[[Any], float]):
        self.function = function

    def finish(self, run: Run) -> None:
        run.notes["ended"] = True
        with np.errstate(all="ignore"):
            run.error = abs(float(self.function(run.sim)))
        if not math.isfinite(run.error):
            run.cause = f"error must be finite, got {run.error} at t = {run.sim.time:g}"

    def judge(self, runs: Sequence[Run]) -> None:
        ended = [run for run in runs if run.notes.get("ended")]
        if ended and all(run.cause for run in ended):
            warnings.warn(
                f"{ended[0].study.owner}: error must be finite for one setting at least, got "
                f"{ended[0].error} for all that reached t = {ended[0].sim.time:g}; choose frames "
                "for which the answer is known, or another error.",
                stacklevel=5,
            )

    def describe(self) -> str:
        return "against the known answer"


class Drift(Judge):
    """The largest change of a conserved quantity, over what the motion amounts to.

    The scale is that of the run that drifts least, so that it is the same for all, and one that
    explodes does not excuse itself.
    """

    bound = 10.0
    watches = True

    def watch(self, run: Run) -> None:
        with np.errstate(all="ignore"):
            now = run.sim.diagnostics()
            value = self.quantity(now)
            start = run.notes.setdefault("start", value)
            change = np.linalg.norm((value - start).reshape(len(value), -1), axis=1)
            for name, size in (("change", change), ("kinetic", now.kinetic)):
                run.notes[name] = np.maximum(run.notes.get(name, 0.0), size)

    def judge(self, runs: Sequence[Run]) -> None:
        alive = [run for run in runs if not run.cause]
        if not alive:
            return
        best = min(
            alive, key=lambda run: float(np.nan_to_num(run.notes["change"], nan=1e300).max())
        )
        scale = self.scale(best)
        for run in alive:
            change = run.notes["change"]
            # Where nothing moves there is nothing to compare with: any change is too much.
            ratio = np.where(change == 0, 0.0, np.inf)
            with np.errstate(all="ignore"):
                np.divide(change, scale, out=ratio, where=scale > 0)
            run.error = float(ratio.max())

    def quantity(self, diagnostics: Any) -> np.ndarray:
        """What is conserved, one row a world."""
        raise NotImplementedError

    def scale(self, run: Run) -> np.ndarray:
        """What it is compared with, one a world."""
        raise NotImplementedError


class EnergyDrift(Drift):
    """Largest change of the energy, over the largest kinetic energy."""

    name = "energy"

    def quantity(self, diagnostics: Any) -> np.ndarray:
        return diagnostics.energy

    def scale(self, run: Run) -> np.ndarray:
        return run.notes["kinetic"]

    def describe(self) -> str:
        return "energy drift over the largest kinetic energy"


class MomentumDrift(Drift):
    """Largest change of the momentum, over sqrt(2 m K): of all masses, at the largest K."""

    name = "momentum"

    def quantity(self, diagnostics: Any) -> np.ndarray:
        return diagnostics.momentum

    def scale(self, run: Run) -> np.ndarray:
        mass = [float(scene.mass[~scene.pinned].sum()) for scene in run.sim.scenes]
        return np.sqrt(2.0 * np.array(mass) * run.notes["kinetic"])

    def describe(self) -> str:
        return "momentum drift over sqrt(2 m K)"
