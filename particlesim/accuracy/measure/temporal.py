"""In time: the limit of no step, of one run, of many seeds, or of averages."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ... import validate
from .. import statistics
from ..statistics import Mean
from .aim import Aim
from .chance import Averages
from .ladder import Ladder
from .levels import Level, Series, needed
from .over import OWNER, period
from .richardson import Limit

PLAIN = 0.9  # of the error, for the step of a plain run where there is nothing else
SURE = 0.3  # of the error, for what is refined, where others are to have their share
DOUBLINGS = 6  # of the frames, at most, until a steady state is seen
SAFE = 4.0  # times less than what leaving out every second frame changes: a cubic makes it 16


def _nothing(step: float) -> float:
    return 0.0


@dataclass(frozen=True)
class Timed:
    """What refining in time has found.

    Args:
        mean: The number, and how far chance may have moved it.
        unsure: What is left of the step.
        order: At which it converges; None where none is to be seen.
        coarsest: The level that it began with.
        substeps: What a plain run needs for its own share of the error.
        worlds: Seeds that it needs.
        frames: Likewise.
        how: In words.
        off: By how much a value at a substep [s] lies above the limit, as far as that is known.
    """

    mean: Mean
    unsure: float
    order: float | None
    coarsest: Level
    substeps: int
    worlds: int
    frames: int
    how: str
    off: Callable[[float], float] = _nothing


def in_time(aim: Aim, share: float | None) -> Timed:
    """Refine substeps, and sample.

    Args:
        aim: What is wanted.
        share: What may be left of the step, where space is to be refined after that, and chance
            has its turn with it; None: all that is wanted.
    """
    bench, error = aim.bench, aim.error
    ladder = Ladder(aim.level, "time", aim.nominal)
    ladder.start()
    if bench.steady:
        _settle(aim, ladder)
    blur = _blur(ladder.levels[0]) if bench.over is period else 0.0
    if blur > SURE * error:
        raise validate.fail(
            OWNER, "settings.dt", f"be short enough for a period to {SURE * error:.2g}", blur,
            "take more frames of a shorter dt",
        )  # fmt: skip
    if isinstance(ladder.levels[0], Series):
        ladder.add()
        ladder.add()
        return _averages(aim, ladder, share)
    if share is not None:
        climbed = ladder.climb(share, math.inf, aim.confidence)
    else:
        part = SURE if bench.chance else 1.0
        climbed = ladder.climb(part * (error - blur), error - blur, aim.confidence)
    if climbed is None:
        return _averages(aim, ladder, share)
    return _limit(aim, ladder, *climbed, blur, share)


def _settle(aim: Aim, ladder: Ladder) -> None:
    """Find the start-up transient, in more frames where it takes them.

    Raises:
        ValueError: No steady state is to be seen.
    """
    bench = aim.bench
    for _ in range(DOUBLINGS):
        level = ladder.levels[0]
        start = statistics.transient(level.history)
        if start is not None:
            bench.leave_out(level.history)
            if level.mean.error < math.inf:
                return
            bench.start = 0
        if isinstance(level, Series):
            level.more(2 * level.amount, "chance")
        else:
            bench.lengthen()
            ladder.begin_anew()
            ladder.start()
    raise validate.fail(
        OWNER, "frames", "reach a steady state, whose average over time is wanted",
        bench.study.frames, "give more, or another over",
    )  # fmt: skip


def _blur(level: Level) -> float:
    """What frames that are apart make of a period."""
    row = level.rows[0]
    times = level.plan.settings.dt * np.arange(len(row))
    return abs(period(times[::2], row[::2]) - period(times, row)) / SAFE


def _limit(
    aim: Aim, ladder: Ladder, found: Limit, mean: Mean, blur: float, share: float | None
) -> Timed:
    """What a ladder has led to."""
    first, last = ladder.levels[0], ladder.levels[-1]
    chance = aim.bench.chance
    allowed = share or (SURE if chance else PLAIN) * (aim.error - blur)
    dt, finest = first.plan.settings.dt, last.plan.settings.substeps
    substeps = finest
    if found.order is not None:
        step = found.step_for(allowed)
        substeps = max(first.plan.settings.substeps, math.ceil(dt / step * (1 - 1e-9)))
    main, left = ladder.levels[ladder.main], aim.error - abs(found.off_at(dt / substeps))
    how = f"{first.plan.settings.substeps} to {finest} substeps, "
    how += str(found)
    return Timed(
        mean, found.unsure + blur, None if found.order == math.inf else found.order, first,
        substeps, needed(main, left, aim.confidence), aim.bench.study.frames, how,
        found.off_at if found.order else _nothing,
    )  # fmt: skip


def _averages(aim: Aim, ladder: Ladder, share: float | None) -> Timed:
    """The average of a chaotic scene."""
    first = ladder.levels[0]
    skipped = ladder.rungs - len(ladder.levels)
    averages = Averages(lambda k: aim.level(k + skipped), ladder.levels, aim.order())
    averages.settle()
    dt, frames = first.plan.settings.dt, aim.bench.study.frames
    least = first.plan.settings.substeps
    if share is not None:
        step = averages.step_for(share, aim.confidence)
        substeps = max(least, math.ceil(dt / step * (1 - 1e-9)))
        how = f"averages at {least} and {2 * least} substeps, order {averages.order:.3g}"
        return Timed(first.mean, share, averages.order, first, substeps, 1, frames, how)
    found = averages.find(aim.error, aim.confidence)
    level = found.level
    step = level.step * (SURE * aim.error / max(found.bias, 1e-300)) ** (1.0 / found.order)
    substeps = max(least, math.ceil(dt / step * (1 - 1e-9)))
    bias = found.bias * (dt / substeps / level.step) ** found.order
    worlds = needed(level, aim.error - bias, aim.confidence)
    if isinstance(level, Series):
        worlds, frames = 1, aim.bench.start + worlds * frames
    finest = max(each.plan.settings.substeps for each in ladder.levels)
    how = f"averages at {least} to {finest} substeps, order {found.order:.3g}"
    return Timed(found.mean, found.unsure, found.order, first, substeps, worlds, frames, how)
