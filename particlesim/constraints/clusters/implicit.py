"""What constraints over clusters share: when a substep is new, limits, what is read of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ...engine import topology
from ...engine.limit import Limit
from ...engine.model import Model
from ...engine.neighbors.lists import Neighbors
from ...engine.probe import Probe
from ...engine.state import State
from ...scene.constraint_base import ConstraintBase
from ...scene.part import Part
from .members import Members


class ImplicitClusters(ConstraintBase):
    """Base of constraints over clusters, which take any step.

    A member has ``count`` rows of its own, and arrays that are sorted as ``members`` are unless
    ``sorting`` says otherwise.
    """

    model: Model
    members: Members
    count: int
    struct: Any  # what kernels take, with marks of what is ``broken`` where anything can be
    fresh: bool  # whether the multipliers are yet to be made anew in this substep

    @property
    def breakable(self) -> bool:
        """Whether one may be gone for good."""
        raise NotImplementedError

    @property
    def sorting(self) -> tuple[np.ndarray, np.ndarray]:
        """The order of its rows, and where those of each world begin."""
        return self.members.order, self.members.edges

    def begin(self, state: State, neighbors: Neighbors, dt: float) -> None:
        self.fresh = True

    def _timing(self, dt: float) -> tuple[int, float, float]:
        """Whether a sweep is the first of its substep, how long that is, and whether time passes.

        In a static projection none does, and nothing moves of itself.
        """
        fresh, self.fresh, timed = int(self.fresh), False, not math.isinf(dt)
        return fresh, dt if timed else 0.0, float(timed)

    def finish(self, state: State, neighbors: Neighbors, dt: float) -> None:
        if self.count and dt > 0 and self.breakable:
            self._strain(1, dt)

    def _strain(self, may_break: int, dt: float) -> wp.array:
        """What each bears in this substep; what exceeds its limit may break."""
        raise NotImplementedError

    def limits(self, probe: Probe) -> list[Limit]:
        """None: it is implicit."""
        return (
            [Limit(self.name, "damping in time", math.inf, "any: implicit")] if self.count else []
        )

    def reset(self, worlds: Sequence[int]) -> None:
        self.forget({**self.persistent(), **self.readable()}, worlds)

    def read_force(self, part: Part) -> np.ndarray:
        dt = self.model.settings.substep
        if not self.count or not dt > 0:
            return np.zeros(self.count)
        return topology.listed(self._strain(0, dt).numpy(), *self.sorting, self, part)

    def read_broken(self, part: Part) -> np.ndarray:
        known = self.count and self.breakable
        marks = self.struct.broken.numpy() if known else np.zeros(self.count)
        return topology.listed(marks, *self.sorting, self, part) > 0
