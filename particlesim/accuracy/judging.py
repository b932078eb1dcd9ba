"""Judging: which error there is to be, and runs in turn, timed and judged by it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from .. import validate
from .converged import Converged
from .judges import EnergyDrift, Judge, Known, MomentumDrift
from .run import Run
from .study import Plan, Study

ERRORS = ("known", "converged", "energy", "momentum")


def choose_judge(study: Study, plans: Sequence[Plan], error: Any, reference: Any) -> Judge:
    """What gives the runs their errors (see :func:`particlesim.tradeoff`)."""
    if error is None:
        known = study.known_here and reference is None
        error = "known" if known else "converged"
    if error != "converged" and reference is not None:
        raise validate.fail(
            study.owner, "error", "be 'converged' with a reference", error, "leave one of them out"
        )
    if callable(error):
        return Known(error)
    validate.choice(study.owner, "error", error, ERRORS)
    if error == "converged":
        return Converged(study, plans, reference)
    if error == "known":
        if study.known is None:
            raise validate.fail(
                study.owner, "error", f"be another where {study.label} has no error(sim)", error,
                "pass a function, 'converged', 'energy' or 'momentum'",
            )  # fmt: skip
        return Known(study.known)
    return EnergyDrift() if error == "energy" else MomentumDrift()


def measure(
    runs: Sequence[Run],
    judge: Judge,
    repeats: int,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Warm up, run in turn, and judge."""
    judge.check(runs)
    done, total = 0, repeats * sum(run.plan.frames for run in runs)

    def count(frames: int = 1) -> None:
        nonlocal done
        done += frames
        if progress is not None:
            progress(done, total)

    for run in runs:
        run.warm_up()
    for repeat in range(repeats):
        watch = judge.watch if judge.watches and repeat == 0 else None
        for run in runs:
            if run.cause and repeat:
                count(run.plan.frames)  # it would go the same way again
                continue
            run.cause = ""
            run.advance(watch, count)
            if repeat == 0 and not run.cause:
                judge.finish(run)
    for run in runs:
        run.sim.close()
    judge.judge(runs)


def mark(runs: Sequence[Run], bound: float) -> None:
    """Have runs count as diverged whose error is not finite or beyond the bound."""
    for run in runs:
        if not run.cause and not run.error <= bound:
            which = "be finite" if not math.isfinite(run.error) else f"be at most {bound:g}"
            run.cause = f"error must {which}, got {run.error:g}"
