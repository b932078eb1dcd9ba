"""Observers: who is told, part by part, what a substep does to the state."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import warp as wp

from .execution.acting import act
from .execution.launch import owner

# What a part is about to do, or has done.
FORCE, FOLLOW, EXCHANGE = "force", "follow", "exchange"
PROJECT, FINISH = "project", "finish"


class Observer:
    """Told around every part of a substep; launches, like a :class:`~particlesim.scene.part.Part`.

    ``host`` says that it works in Python, and so has to be called in every substep.
    """

    name = "observer"  # of what it keeps, in checkpoints
    host = False

    def begin(self, dt: float) -> None:
        """A substep begins."""

    def before(self, part: Any, stage: str) -> None:
        """``part`` is about to act."""

    def after(self, part: Any, stage: str) -> None:
        """``part`` has acted."""

    def end(self, dt: float) -> None:
        """The substep is done."""

    def carried(self) -> list[wp.array]:
        """What the next kick takes from the last evaluation of the forces, row by particle."""
        return []

    def persistent(self) -> dict[str, wp.array]:
        """Arrays that outlive a substep, for snapshots and checkpoints."""
        return {}

    def readable(self) -> dict[str, wp.array]:
        """Arrays of the last substep that users can read something from, for checkpoints."""
        return {}

    def worlds(self, name: str, array: wp.array) -> np.ndarray | None:
        """The world of each row of one of these arrays; None: its rows are no world's own."""
        return None

    @property
    def memory(self) -> int:
        """Bytes of all its arrays."""
        return 0


class Observers:
    """All observers of a loop; mostly none."""

    def __init__(self) -> None:
        self.all: list[Observer] = []

    def begin(self, dt: float) -> None:
        """A substep begins."""
        for each in self.all:
            act(each, each.begin, dt)

    def end(self, dt: float) -> None:
        """The substep is done."""
        for each in self.all:
            act(each, each.end, dt)

    def carried(self) -> list[wp.array]:
        """What all of them take from one evaluation of the forces to the next."""
        return [array for each in self.all for array in each.carried()]

    def act(self, part: Any, stage: str, function: Callable[..., None], *arguments: Any) -> None:
        """Have ``part`` do something; what it launches is remembered as its own."""
        for each in self.all:
            act(each, each.before, part, stage)
        with owner(part.name):
            act(part, function, *arguments)
        for each in self.all:
            act(each, each.after, part, stage)

    @contextmanager
    def watching(self, observer: Observer) -> Iterator[None]:
        """Have ``observer`` told, for a while."""
        self.all.append(observer)
        try:
            yield
        finally:
            self.all.remove(observer)
