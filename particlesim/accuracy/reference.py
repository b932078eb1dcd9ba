"""Reference: what runs are compared with, and how far off it may itself be."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .observables import Observable
from .series import Apart, World, apart, moving, scale_of, shortest, step_between

Seen = list[list[np.ndarray]]  # values by observable and world, each (times + 1, ...)


class Reference:
    """What runs are compared with: values over time, and how far off they may themselves be.

    Args:
        observables: What is looked at; the first decides.
        over: How differences over time become one number.
        worlds: Boxes and who may move, world by world.
        values: By observable and world, the start first: (times + 1, ...).
    """

    def __init__(
        self, observables: Sequence[Observable], over: str, worlds: Sequence[World], values: Seen
    ):
        self.observables, self.over, self.worlds, self.values = observables, over, worlds, values
        self.own_error = 0.0
        self.counted = [
            moving(observables[0], world, values[0][w]) for w, world in enumerate(worlds)
        ]

    def steps(self, values: Seen, observed: int, world: int) -> np.ndarray:
        """Differences of values from these after the start, (times, ...)."""
        seen, own = self.observables[observed], self.values[observed][world]
        return step_between(seen, self.worlds[world], values[observed][world][1:], own[1:])

    def apart(self, values: Seen, observed: int = 0) -> list[Apart]:
        """How far values are apart from these, world by world."""
        return [
            apart(
                self.observables[observed], world, self.steps(values, observed, w), self.over,
                self.counted[w],
            )
            for w, world in enumerate(self.worlds)
        ]  # fmt: skip

    @property
    def scale(self) -> float:
        """What errors are compared with: the largest change of the first observable (median)."""
        return float(
            np.median(
                [
                    scale_of(self.observables[0], world, self.values[0][w], self.counted[w])
                    for w, world in enumerate(self.worlds)
                ]
            )
        )

    def farthest(self, values: Seen) -> Apart:
        """The largest distance of all worlds."""
        return max(self.apart(values), key=lambda each: each.rms)


def nearest(sim: Any, d: np.ndarray) -> np.ndarray:
    """Displacements of all particles (n, 3) by the short way round their boxes."""
    return shortest(d, sim.model.box_length[sim.model.world_of])


@np.errstate(all="ignore")
def rms(d: np.ndarray) -> float:
    """Root mean square length of vectors (n, 3)."""
    return float(np.sqrt((d**2).sum(axis=1).mean())) if len(d) else 0.0
