"""Round-off: what the other precision makes of the same run."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ...instruments.watchdog.incident import SimulationError
from .aim import Aim
from .levels import PILOT, Level

LAST_BIT = 2.0**-29  # of float64, over that of float32
SAME = 0.3  # of the error that float32 may make, for it to be enough


@dataclass(frozen=True)
class Rounded:
    """What rounding does.

    Args:
        error: In float64, in which the number was found.
        precision: That a plain run needs.
        how: In words.
    """

    error: float
    precision: str
    how: str


def round_off(aim: Aim, coarsest: Level, substeps: int) -> Rounded:
    """Run the coarsest level in float32.

    Rounding goes with the last bit, and at random with each substep: with the root of how many.

    Args:
        aim: What is wanted.
        coarsest: In float64.
        substeps: Of a plain run.
    """
    settings = coarsest.plan.settings
    single = aim.level_of(aim.plan(settings.substeps, precision="float32"))
    try:
        single.more(min(PILOT, coarsest.amount), "round-off")
    except SimulationError as error:
        return Rounded(0.0, "float64", f"float32 fails: {error}")
    change = single.above(coarsest)
    hidden = abs(change.value) <= change.reach(aim.confidence)
    most = abs(change.value) * math.sqrt(max(1.0, substeps / settings.substeps))
    enough = hidden or most <= SAME * aim.error
    how = f"float32 differs by {abs(change.value):.2g}"
    return Rounded(
        LAST_BIT * most, "float32" if enough else "float64",
        f"{how}, within chance" if hidden and change.error else how,
    )  # fmt: skip
