"""Constraints on radii that give way to the overlaps of a start."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import warp as wp

from ..engine.easing import Easing
from ..scene.constraint_base import ConstraintBase


class EasedConstraint(ConstraintBase):
    """A constraint on particles' radii that gives way to the overlaps of a start.

    A member makes its ``easing`` when it is attached, if it holds particles at all.
    """

    count: int  # of the particles that it holds
    easing: Easing

    def persistent(self) -> dict[str, wp.array]:
        return self.easing.persistent() if self.count else {}

    def reset(self, worlds: Sequence[int]) -> None:
        self.placed(worlds)

    def placed(self, worlds: Iterable[int]) -> None:
        if self.count:
            self.easing.mark(worlds)
