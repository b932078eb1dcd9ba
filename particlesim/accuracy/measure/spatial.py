"""In space: the limit of a resolution without end, with substeps that go along with it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from ..statistics import Mean
from .aim import Aim
from .ladder import Ladder
from .levels import Level, needed
from .temporal import PLAIN, SURE, Timed

FINER = math.sqrt(2.0)  # from one level to the next
ORDER = 2.0  # of most that is discretised in space; another is found with one level more


@dataclass(frozen=True)
class Spaced:
    """What refining in space has found.

    Args:
        mean: The number, and how far chance may have moved it.
        unsure: What is left of the resolution.
        option: Value that a plain run needs.
        substeps: Likewise.
        worlds: Likewise.
        how: In words.
    """

    mean: Mean
    unsure: float
    option: Any
    substeps: int
    worlds: int
    how: str


def in_space(aim: Aim, timed: Timed, name: str, coarsest: Any) -> Spaced:
    """Refine a resolution, substeps with it.

    Args:
        aim: What is wanted.
        timed: What refining in time has found at the coarsest.
        name: Option of ``build``: a float is a spacing, a whole number counts.
        coarsest: Its value.
    """
    counts = isinstance(coarsest, int)

    def value(k: float) -> Any:
        fine = FINER**k
        return round(coarsest * fine) if counts else coarsest / fine

    def substeps(option: Any) -> int:
        return math.ceil(timed.substeps * (option / coarsest if counts else coarsest / option))

    def make(k: int) -> Level:
        option = value(k)
        plan = aim.plan(substeps(option), **{name: option})
        level = Level(aim.bench, plan, 1.0 / option if counts else option)
        level.off = timed.off(plan.settings.substep)
        return level

    chance = aim.bench.chance
    ladder = Ladder(make, "space", ORDER)
    left = aim.error - timed.unsure
    climbed = ladder.climb(left * (1.0 - SURE if chance else 1.0), left, aim.confidence)
    assert climbed is not None  # only time finds chaos
    found, mean = climbed
    share = left * (SURE if chance else PLAIN)
    step = ladder.levels[-1].step if found.order is None else found.step_for(share)
    step = min(step, ladder.levels[0].step)
    option = math.ceil(1.0 / step * (1 - 1e-9)) if counts else float(f"{step:.4g}")
    first, last = (level.plan.options[name] for level in (ladder.levels[0], ladder.levels[-1]))
    return Spaced(
        mean, found.unsure, option, substeps(option),
        needed(ladder.levels[ladder.main], left - abs(found.off_at(step)), aim.confidence),
        f"{name} {first:.4g} to {last:.4g}, {found}",
    )  # fmt: skip
