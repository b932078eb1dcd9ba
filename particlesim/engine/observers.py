"""Observers: who is told, part by part, what a substep does to the state."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from .execution.launch import owner

FORCE, PROJECT, FINISH = "force", "project", "finish"  # what a part is about to do, or has done


class Observer:
    """Told around every part of a substep. While a frame is recorded it may only launch."""

    def begin(self, dt: float) -> None:
        """A substep begins."""

    def before(self, part: Any, stage: str) -> None:
        """``part`` is about to act."""

    def after(self, part: Any, stage: str) -> None:
        """``part`` has acted."""

    def end(self, dt: float) -> None:
        """The substep is done."""


class Observers(Observer):
    """All observers of a simulation; mostly none."""

    def __init__(self) -> None:
        self.all: list[Observer] = []

    def begin(self, dt: float) -> None:
        for each in self.all:
            each.begin(dt)

    def end(self, dt: float) -> None:
        for each in self.all:
            each.end(dt)

    @contextmanager
    def acting(self, part: Any, stage: str) -> Iterator[None]:
        """Around what ``part`` launches; the launches are remembered as its own."""
        for each in self.all:
            each.before(part, stage)
        with owner(part.name):
            yield
        for each in self.all:
            each.after(part, stage)

    @contextmanager
    def watching(self, observer: Observer) -> Iterator[None]:
        """Have ``observer`` told, for a while."""
        self.all.append(observer)
        try:
            yield
        finally:
            self.all.remove(observer)
