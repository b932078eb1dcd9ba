"""Tune: from a scene and a tolerance, or a time, to settings.

Example:
    >>> from particlesim import Drag, Scene, Settings
    >>> ball = Scene()
    >>> _ = ball.add_particles([(0, 0, 0)], velocity=(1, 0, 0))
    >>> _ = ball.add_interaction(Drag(linear=1.0))
    >>> tune(lambda: ball, 1e-3, frames=5, settings=Settings(dt=0.1), device="cpu").error < 1e-3
    True
"""

from __future__ import annotations

import dataclasses
import math
import sys
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from ... import validate
from ...scene.settings import Settings
from ..converged import times_of
from ..judging import which_error
from ..observables import observable
from ..reference import Reference
from ..refining import settled
from ..series import OVER
from ..study import Study
from .along import Along
from .bench import Bench
from .ladders import Ladder, finest, ladders
from .report import Trial, Tuned
from .search import BETTER, Search
from .spend import Spend

OWNER = "tune"
LONGER = 1.13  # times the run: so much longer the tolerance is held too
MARGINS = (0.8, 0.9)  # of one start, and of several seeds
FINER = 4  # times the substeps of the run that shows where a known answer holds
ROUNDS = 3  # of searching, while more is learnt about where it does
UNITS = {"": 1.0, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0}


def tune(
    build: Callable[..., Any], error: float = 1e-3, *, budget: float | str | None = None,
    by: Callable[[Any], float] | str | None = None,
    observe: Callable[[Any], Any] | str | None = None, over: str | None = None,
    vary: Mapping[str, Iterable[Any]] | None = None, reference: Any = None,
    margin: float | None = None, seeds: int = 3, repeats: int = 3, frames: int | None = None,
    settings: Settings | None = None, options: Mapping[str, Any] | None = None,
    device: Any = None, progress: bool | Callable[[Trial], None] = False,
) -> Tuned:  # fmt: skip
    """The cheapest settings whose error is at most ``error``, or the best that ``budget`` buys.

    Substeps are sought between the stability limit (``Simulation.stability``) and where more stop
    to help; integrator, precision, iterations, skin and compensation, and what ``vary`` names, are
    changed one by one as long as that makes it cheaper. The largest error of all seeds tried, and
    as much as they differ on top of it, must be within ``margin`` of the tolerance, over 13 % more
    time than ``frames`` unless ``over`` says otherwise.

    Args:
        build: As for :func:`particlesim.tradeoff`. With an option ``seed`` several are tried.
        error: The tolerance, in units of what it is measured by.
        budget: A time for a run of ``frames`` frames, in seconds or as ``"60 s"``, ``"5 min"``.
        by, observe: What the error is: ``error=`` and ``observe=`` of ``tradeoff``.
        over: As there. None: the largest of all frames; of a known answer, of the end and of the
            times before at which it proves to be known, as a finer run has less of it there.
        vary: Values of further knobs and of options of ``build`` by name, or other values of those
            above; a list of one holds a knob as it is.
        reference: Positions (n, 3) at the end, where one seed is tried; None: a run that is
            refined until it changes by less than a tenth of the tolerance.
        margin: Part of the tolerance to stay under, above 0, at most 1. None: 0.9, or 0.8 where
            there are no seeds that would show what another start does.
        seeds: How many seeds to try everything with, at least 1.
        repeats: Timed runs, in turn, of the best and what differs from it only in cost.
        frames, settings, options, device: As for ``tradeoff``; the settings to start from.
        progress: True to print every trial to stderr, or a function of it.

    Raises:
        ValueError: Nothing meets the tolerance (the message says how small the error got), the
            reference does not settle far below it, or arguments that do not fit.
    """
    seeds = validate.whole(OWNER, "seeds", seeds, minimum=1)
    seeds = 1 if reference is not None else seeds
    study = Study(OWNER, build, settings, options, frames, device, seeds=seeds)
    tolerance = validate.number(OWNER, "error", error, above=0.0)
    if over is not None:
        validate.choice(OWNER, "over", over, OVER)
    if margin is None:
        margin = MARGINS[len(study.seeds) > 1]
    margin = validate.number(OWNER, "margin", margin, above=0.0, maximum=1.0)
    validate.whole(OWNER, "repeats", repeats, minimum=1)
    show = _print if progress is True else progress if callable(progress) else None
    tuning = _Tuning(study, by, observe, over, reference, margin, dict(vary or {}), show)
    if budget is not None:
        return tuning.within(_seconds(budget), repeats)
    return tuning.under(tolerance, repeats)


class _Tuning:
    """A search that is set up (see :func:`tune`)."""

    def __init__(
        self,
        study: Study,
        by: Any,
        observe: Any,
        over: str | None,
        reference: Any,
        margin: float,
        vary: dict[str, Iterable[Any]],
        show: Callable[[Trial], None] | None,
    ):
        self.margin, self.show, self.observe, self.over = margin, show, observe, over
        self.kind = which_error(study, by, reference, observe)
        self.ladders, self.substeps, self.polish = ladders(study, vary)
        longer = over in (None, "max") and reference is None
        frames = math.ceil(LONGER * study.frames) if longer else study.frames
        self.given, self.frames, self.study = reference, study.frames, study.replace(frames=frames)
        function = study.known if self.kind == "known" else self.kind
        self.along = None
        if callable(function) and over is None:
            self.along = Along(function, self.frames, frames)

    def under(self, tolerance: float, repeats: int) -> Tuned:
        """The cheapest settings under a tolerance."""
        bench = self._bench(tolerance)
        target = self.margin * tolerance
        best = self._learnt(bench, tolerance)
        if best is None:
            least = min((each.bound for each in bench.trials), default=math.inf)
            raise validate.fail(
                OWNER, "error",
                f"be at least {least / self.margin:.3g}, the smallest found over margin",
                tolerance, "allow more, or vary what the error depends on",
            )  # fmt: skip
        polished = _polished(bench, best, self.polish, target, repeats)
        return self._tuned(bench, polished, tolerance, None)

    def within(self, seconds: float, repeats: int) -> Tuned:
        """The settings of the least error for a time."""
        cost = seconds / (self.frames * self.study.settings.dt)
        # How small the error will be is not known, and how good the reference has to be neither.
        tolerance = self._coarse()
        while True:
            bench = self._bench(tolerance)
            best = self._spent(bench, cost)
            if best is None:
                raise validate.fail(
                    OWNER, "budget", "suffice for the fewest substeps that are stable, "
                    f"{self.substeps[0]}", f"{seconds:g} s", "allow more, or fewer frames",
                )  # fmt: skip
            if bench.reference is None or best.bound >= tolerance or best.bound == 0.0:
                break
            tolerance = best.bound
        (cost,) = bench.costs([best.values], repeats)
        return self._tuned(bench, dataclasses.replace(best, cost=cost), best.bound, seconds)

    def _spent(self, bench: Bench, cost: float) -> Trial | None:
        """The least error for a cost; of a known answer, wherever it turns out to hold."""
        for _ in range(ROUNDS):
            spend = Spend(bench, cost, self.ladders, self.substeps[0])
            best = spend.run(self.study.settings.substeps)
            if best is None or self.along is None:
                break
            fewer = max(best.values["substeps"] // FINER, self.substeps[0])
            if not self.along.learn(bench.trial({**best.values, "substeps": fewer}), best, 0.0):
                break
            bench.look_again()
        return best

    def _coarse(self) -> float:
        """A tolerance to begin with: a tenth of what the particles or values change by."""
        if self.kind != "converged" or self.given is not None:
            return math.inf
        return 1e-2 * max(self._reference(math.inf).scale, 1e-300)

    def _bench(self, tolerance: float) -> Bench:
        """Tries settings, by a reference that is good enough."""
        reference = self.given
        if self.kind == "converged" and reference is None:
            reference = self._reference(tolerance)
        by = self.along or self.kind
        return Bench(
            self.study, by, reference, self.observe, self.over, self.margin, self.show
        )  # fmt: skip

    def _reference(self, tolerance: float) -> Reference:
        over, names = self.over or "max", [self.observe or "position"]
        observables = [observable(OWNER, name) for name in names]
        substeps = 2 * self.study.settings.substeps  # past where impacts make it irregular
        first = finest(OWNER, self.ladders, substeps)
        own = {name: value for name, value in first.items() if name != "substeps"}
        plans = [
            self.study.plan({**own, "dt": dt})
            for dt in self.ladders.get("dt", [self.study.settings.dt])
        ]
        times = times_of(self.study, plans, over, observables)
        return settled(self.study, first, tolerance, observables, over, times)

    def _learnt(self, bench: Bench, tolerance: float) -> Trial | None:
        """Search; of a known answer, again where it turns out to hold at more times."""
        weights: dict[tuple[str, str], float] = {}
        for _ in range(ROUNDS):
            search = Search(bench, self.margin * tolerance, self.ladders, self.substeps, weights)
            best = search.run(self.study.settings.substeps)
            if best is None or self.along is None:
                return best
            wanted = FINER * best.values["substeps"]
            finer = min((n for n in self.substeps if n >= wanted), default=self.substeps[-1])
            fine = bench.trial({**best.values, "substeps": finer})
            if not self.along.learn(best, fine, tolerance):
                return best
            bench.look_again()
        return best

    def _tuned(self, bench: Bench, best: Trial, tolerance: float, budget: float | None) -> Tuned:
        return Tuned(
            scene=self.study.label, tolerance=tolerance, measure=bench.words, best=best,
            trials=tuple(bench.trials), seeds=max(len(self.study.seeds), 1), device=bench.device,
            margin=self.margin, budget=budget, longer=self.study.frames / self.frames - 1.0,
            seconds=best.cost * self.frames * self.study.settings.dt,
            floor=getattr(bench.reference, "own_error", 0.0),
        )  # fmt: skip


def _polished(bench: Bench, best: Trial, polish: Ladder, target: float, repeats: int) -> Trial:
    """The best with those knobs that change hardly more than the cost, all timed in turn."""
    rivals: list[dict[str, Any]] = [dict(best.values)]
    for name, values in polish.items():
        rivals += [{**best.values, name: value} for value in values]
    costs = bench.costs(rivals, repeats)
    for k in np.argsort(costs, kind="stable"):
        if k == 0 or costs[k] > BETTER * costs[0]:
            break
        trial = bench.trial(rivals[k])
        if trial.bound <= target:
            return dataclasses.replace(trial, cost=costs[k])
    return dataclasses.replace(best, cost=costs[0])


def _seconds(budget: float | str) -> float:
    """A time as seconds: a number, or as ``"60 s"``."""
    value: Any = budget
    if isinstance(budget, str):
        digits = budget.rstrip("abcdefghijklmnopqrstuvwxyz ")
        unit = budget[len(digits) :].strip()
        try:
            value = float(digits) * UNITS[unit]
        except (KeyError, ValueError):
            raise validate.fail(
                OWNER, "budget", f"be a number and a unit, {', '.join(UNITS)[2:]}", budget,
                "write '60 s', say",
            ) from None  # fmt: skip
    return validate.number(OWNER, "budget", value, above=0.0, unit="s")


def _print(trial: Trial) -> None:
    print(trial, file=sys.stderr, flush=True)
