"""Refining: runs of a scene whose steps are made finer until what is looked at stops changing.

What all settings share, a reference would share too if its substeps were multiples of theirs: a
push between their samples is then between its own. So its substeps are odd and 2 n + 1 follows n:
two of them meet at the ends of frames only. Laws of time are looked at once more, much finer.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from .. import validate
from ..instruments.watchdog.incident import SimulationError, SimulationWarning
from ..simulation.simulation import Simulation
from .observables import Observable
from .reference import Reference
from .series import Series, World
from .study import Plan, Study

PATIENCE = 3  # changes before it counts that they do not fall; one less where they are large
LARGE = 0.3  # of what there is to be seen
SETTLING = 0.7  # of the largest change so far; more is no convergence, of any order
ORDERLY = 0.2  # by which changes may miss the ratio that extrapolation rests on
SHARE = 0.1  # of the smallest error to be seen that the reference may still change by
REFINEMENTS = 12  # at most, where the tolerance is known
ROUND_OFF = 1e-13  # of the scene's size, float64: nothing below it can be told apart
SAMPLES = 2**18  # substeps of the last look at a law of time, of few particles
WORK = 3e7  # particle-substeps of it, at most
TIME = "time"


class Refining:
    """Runs of a plan, their substeps refined from one to the next, while that leads anywhere.

    Iterating gives a :class:`Reference` after each run. It stops after ``most`` runs, or when the
    changes no longer fall, as those of a chaotic scene. Runs that diverge give nothing. ``change``
    is by how much the last refinement changed the values. As long as the changes fall with the
    order of the integrator, p, ``limit`` holds the values extrapolated to no step at all,
    x' + (x' - x) / (r^p - 1) after r times the substeps (Richardson 1911), and ``limit_change`` by
    how much these changed; otherwise that is infinite.

    Args:
        study: The scene.
        plan: Of the first run.
        most: How many runs, at most.
        observables, over: As for Reference.
        times: How often values are kept along the run.
    """

    def __init__(
        self,
        study: Study,
        plan: Plan,
        most: int,
        observables: Sequence[Observable],
        over: str,
        times: int,
    ):
        self.study, self.plan, self.most = study, plan, most
        self.observables, self.over, self.times = observables, over, times
        self.last: Reference | None = None
        self.limit: Reference | None = None
        self.changes: list[float] = []
        self.limit_change = math.inf
        self.chance = 0.0  # how large the last change might be by chance
        self.timed = False
        self.remedy = (
            "use fewer frames, if the scene is chaotic, averages over time, or another error"
        )
        self.ratio = 1.0  # of the substeps of the last run to those before

    @property
    def change(self) -> float:
        return self.changes[-1] if self.changes else math.inf

    def __iter__(self) -> Iterator[Reference]:
        for number in range(self.most):
            if number:
                self._refine(2 * self.plan.settings.substeps + 1)
            reference = self._run()
            if reference is not None:
                yield reference
                if self._is_chaotic(reference):
                    return  # further refinement would only cost

    def _doubt(self, order: float) -> float:
        """How far off the last run may be: its change, or that to be expected by the one before.

        A single small change may be luck, as of impacts: of one there is nothing to be said yet.
        """
        if len(self.changes) < 2:
            return self.change if self.most <= 2 and self.changes else math.inf
        return max(self.change, self.changes[-2] / self.ratio**order)

    def _is_chaotic(self, reference: Reference) -> bool:
        """Whether the changes do not fall, as those of impacts do not at first."""
        large = self.change > LARGE * reference.scale
        enough = len(self.changes) > (PATIENCE - 1 if large else PATIENCE)
        return enough and self.change > SETTLING * max(self.changes[:-1])

    def _refine(self, substeps: int) -> None:
        self.ratio = substeps / self.plan.settings.substeps
        values = {**self.plan.values, "substeps": substeps}
        self.plan = self.study.plan(values, "reference")

    def _run(self) -> Reference | None:
        """The reference of the present plan, compared with the last one; None if it diverges."""
        series = Series(self.observables, max(self.plan.frames // self.times, 1))
        sim = ended(self.study, self.plan, series.add)
        if sim is None:
            self.last, self.limit, self.changes = None, None, []
            return None
        self.timed = any(TIME in part.requires for part in sim.loop.parts)
        self.size = sim.particle_count
        worlds = World.all_of(sim)
        values = [
            [series.of(k, w) for w in range(len(worlds))] for k in range(len(self.observables))
        ]
        before, self.last = self.last, Reference(self.observables, self.over, worlds, values)
        if before is not None and self.ratio > 1.0:
            self._compare(before, self.last, float(sim.integrator.order))
        self.last.own_error = max(self._doubt(float(sim.integrator.order)), self.chance)
        return self.last

    @np.errstate(all="ignore")
    def _compare(self, before: Reference, now: Reference, order: float) -> None:
        """Note the change, and the values without any step."""
        change = now.farthest(before.values)
        self.changes.append(change.rms)
        self.chance = change.chance
        power = self.ratio**order
        limit = [
            [
                np.concatenate([x[:1], x[1:] - before_step / (power - 1.0)])
                for w, x in enumerate(of)
                for before_step in [now.steps(before.values, k, w)]
            ]
            for k, of in enumerate(now.values)
        ]
        last, self.limit = self.limit, Reference(self.observables, self.over, now.worlds, limit)
        self.limit_change = math.inf
        # Multiplied out, as a change may be zero.
        orderly = len(self.changes) > 1 and (
            abs(self.changes[-2] - power * self.change) < ORDERLY * power * self.change
        )
        if orderly and last is not None:
            self.limit_change = self.limit.farthest(last.values).rms
        self.limit.own_error = self.limit_change

    def confirm(self, found: Reference) -> Reference:
        """A reference of a scene with laws of time, held against a much finer look.

        What acts for a short while only is seen by nobody who does not look then. So many more
        substeps are taken; where they agree, the reference stays, and else theirs is the better
        one, off by as much as they differ.
        """
        substeps = int(min(SAMPLES, WORK / max(self.size, 1)) / self.plan.frames) | 1
        if not self.timed or substeps <= self.plan.settings.substeps:
            return found
        self._refine(substeps)
        off, finer = found.own_error, self._run()
        if finer is None:
            return found
        apart_by = finer.farthest(found.values).rms
        if apart_by <= 2.0 * off or apart_by <= self.enough(0.0):
            return found
        finer.own_error = apart_by
        self.remedy = "a law of time acts between their substeps; have it act for longer, or weaker"
        return finer

    def coarser(self, space: Mapping[str, Sequence[Any]]) -> Reference:
        """The last reference, off by what a coarser resolution of space, the first of each of
        these, makes of it.
        """
        assert self.last is not None
        held = self.last
        values = {**self.plan.values, **{name: each[0] for name, each in space.items()}}
        self.plan = self.study.plan(values, "reference")
        self.ratio = 1.0
        if self._run() is not None:
            assert self.last is not None
            held.own_error = max(held.own_error, self.last.farthest(held.values).rms)
        return held

    def enough(self, allowed: float) -> float:
        """The change that counts as none: the allowed one, or that of rounding or of chance."""
        assert self.last is not None
        sizes = [float(np.abs(x).max(initial=0.0)) for x in self.last.values[0]]
        return max(allowed, ROUND_OFF * max(sizes), self.chance)

    def diverged(self) -> SimulationError:
        """The error for the caller to raise where no run came to its end."""
        return SimulationError(
            f"{self.study.owner}: the reference has diverged even at "
            f"{self.plan.settings.substeps} substeps; give more, frames that end before it does, "
            "or another error."
        )

    def unsettled(self) -> Reference:
        """The last values, with a warning.

        Raises:
            SimulationError: It diverges however fine.
        """
        if self.last is None:
            raise self.diverged()
        warnings.warn(
            f"{self.study.owner}: the reference must stop changing, got {self.change:.3g} from "
            f"refining to {self.plan.settings.substeps} substeps; smaller errors mean nothing: "
            f"{self.remedy}.",
            stacklevel=6,
        )
        return self.last


def settled(
    study: Study,
    finest: Mapping[str, Any],
    tolerance: float,
    observables: Sequence[Observable],
    over: str = "final",
    times: int = 1,
) -> Reference:
    """A reference that refining changes by a tenth of ``tolerance``.

    An extrapolated one where these settle first, which is much earlier.

    Args:
        study: The scene.
        finest: Knobs and options of the first run, ``substeps`` among them, which are refined.
        tolerance: In units of the first observable.
        observables, over, times: As for Refining.

    Raises:
        SimulationError: It diverges however fine. ValueError: It does not settle, as that of a
            chaotic scene does not, or not at what a finer look at laws of time has seen.
    """
    finest = {**finest, "substeps": finest["substeps"] | 1}
    plan = study.plan({"precision": "float64", "compensated": True, **finest}, "reference")
    refining = Refining(study, plan, REFINEMENTS, observables, over, times)
    for found in refining:
        enough = refining.enough(SHARE * tolerance)
        if refining.limit is not None and refining.limit_change <= enough < refining.change:
            found = refining.limit
        if found.own_error <= enough and refining.changes:
            found = refining.confirm(found)
            if found.own_error <= enough:
                return found
            break
    if refining.last is None:
        raise refining.diverged()
    raise validate.fail(
        study.owner, "reference", f"be known to {SHARE * tolerance:.3g}, a tenth of the tolerance",
        refining.change,
        f"refining to {refining.plan.settings.substeps} substeps changed it by that: "
        f"{refining.remedy}",
    )  # fmt: skip


def ended(study: Study, plan: Plan, watch: Callable[[Simulation], None]) -> Simulation | None:
    """The simulation of a plan at its end, looked at on the way; None if it diverges."""
    sim = study.batch(plan)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SimulationWarning)  # how wrong it is will be seen
            watch(sim)
            for _ in range(plan.frames):
                sim.step()
                watch(sim)
    except SimulationError:
        return None
    finally:
        sim.close()
    return sim
