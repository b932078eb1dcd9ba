"""Overlaps of a start, called in slowly: the host's side of kernels.engine.easing."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import warp as wp

from ..kernels.engine.easing import easing_type
from .model import Model

FRAMES = 30.0  # in which slack falls to 1/e, where the depenetration speed allows


class Easing:
    """Slack of each particle, and the marks of worlds whose slack is yet to be measured.

    Args:
        model: Whose settings bound the speed.
        count: Entries.
        dtype: Number or vector.
        ends: How many ends of a contact give way: the speed is shared between them.
    """

    def __init__(self, model: Model, count: int, dtype: Any, ends: int):
        self.slack = wp.zeros(count, dtype=dtype, device=model.device)
        self.marked = wp.ones(model.world_count, dtype=wp.int32, device=model.device)
        self.any_marked = wp.ones(1, dtype=wp.int32, device=model.device)
        settings = model.settings
        frame = max(settings.dt, float(np.finfo(model.precision.numpy).tiny))
        speed = settings.depenetration_speed
        self.struct = easing_type(model.precision)()
        self.struct.speed = 0.0 if speed is None else speed / ends
        self.struct.radii_per_time = 1.0 / (frame * ends) if speed is None else 0.0
        self.struct.rate = 1.0 / (FRAMES * frame)

    def mark(self, worlds: Iterable[int]) -> None:
        """Have the slack of these worlds measured at the start of the next substep."""
        for w in worlds:
            self.marked[w : w + 1].fill_(1)
        self.any_marked.fill_(1)

    def unmark(self) -> None:
        """All is measured; device work."""
        self.marked.zero_()
        self.any_marked.zero_()

    def persistent(self) -> dict[str, wp.array]:
        """What outlives a substep."""
        return {"slack": self.slack, "marked": self.marked, "any_marked": self.any_marked}
