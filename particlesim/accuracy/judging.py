"""Judging: which error there is to be, and runs in turn, timed and judged by it."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from .. import validate
from ..instruments.watchdog.incident import SimulationWarning
from ..scene.settings import Settings
from .converged import Converged
from .judges import EnergyDrift, Judge, Known, MomentumDrift
from .reference import Reference
from .run import LEAST, Run
from .series import OVER
from .study import Plan, Study

ERRORS = ("known", "converged", "energy", "momentum")


def choose_judge(
    study: Study,
    plans: Sequence[Plan],
    error: Any,
    reference: Any,
    observe: Any = None,
    over: str | None = None,
) -> Judge:
    """What gives the runs their errors (see :func:`particlesim.tradeoff`)."""
    owner = study.owner
    if over is not None:
        validate.choice(owner, "over", over, OVER)
    error = which_error(study, error, reference, observe)
    if error != "converged" and reference is not None:
        raise validate.fail(
            owner, "error", "be 'converged' with a reference", error, "leave one of them out"
        )
    if callable(error):
        return Known(error, over or "final")
    validate.choice(owner, "error", error, ERRORS)
    if error == "converged":
        along = isinstance(reference, Mapping | Settings | Reference | None)
        return Converged(study, plans, reference, observe, over or ("max" if along else "final"))
    if error == "known":
        if study.known is None:
            raise validate.fail(
                owner, "error", f"be another where {study.label} has no error(sim)", error,
                "pass a function, 'converged', 'energy' or 'momentum'",
            )  # fmt: skip
        return Known(study.known, over or "final")
    return EnergyDrift(over or "max") if error == "energy" else MomentumDrift(over or "max")


def which_error(study: Study, error: Any, reference: Any, observe: Any) -> Any:
    """The error that is meant: what is observed is compared with a reference."""
    if observe is not None:
        if error not in (None, "converged"):
            raise validate.fail(
                study.owner, "error", "be left out, or 'converged', with observe", error,
                "give one of the two",
            )  # fmt: skip
        return "converged"
    if error is None:
        return "known" if study.known_here and reference is None else "converged"
    return error


def measure(
    runs: Sequence[Run],
    judge: Judge,
    repeats: int,
    progress: Callable[[int, int], None] | None = None,
    least: float = LEAST,
) -> None:
    """Warm up, run in turn, and judge.

    Args:
        runs: What is measured.
        judge: Gives the errors.
        repeats: Of each.
        progress: Gets the frames done, and all there are.
        least: Seconds of each to be measured, in all repeats together.
    """
    judge.check(runs)
    with warnings.catch_warnings():
        # That coarse settings are wrong is what is measured.
        warnings.simplefilter("ignore", SimulationWarning)
        _run_in_turn(runs, judge, repeats, progress, least)
    judge.judge(runs)


def _run_in_turn(
    runs: Sequence[Run],
    judge: Judge,
    repeats: int,
    progress: Callable[[int, int], None] | None,
    least: float,
) -> None:
    """Every run once in each repeat; the first is looked at by the judge."""
    done, total = 0, repeats * sum(run.plan.frames for run in runs)

    def count(frames: int = 1) -> None:
        nonlocal done
        done += frames
        if progress is not None:
            progress(done, total)

    for run in runs:
        run.warm_up()
        run.least = least / repeats
    for repeat in range(repeats):
        for run in runs:
            if run.cause and repeat:
                count(run.plan.frames)  # it would go the same way again
                continue
            run.cause = ""
            watch = judge.watch if judge.watches and repeat == 0 else None
            apart = repeat == 0 and run.apart(watch is not None)
            if apart:
                run.examine(watch)
                if not run.cause:
                    judge.finish(run)
            run.advance(None if apart else watch, count)
            if repeat == 0 and not apart and not run.cause:
                judge.finish(run)
    for run in runs:
        run.sim.close()
        run.judged.close()


def mark(runs: Sequence[Run], bound: float) -> None:
    """Have runs count as diverged whose error is not finite or beyond the bound."""
    for run in runs:
        if not run.cause and not run.error <= bound:
            which = "be finite" if not math.isfinite(run.error) else f"be at most {bound:g}"
            run.cause = f"error must {which}, got {run.error:g}"
