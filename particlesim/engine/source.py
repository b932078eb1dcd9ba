"""Source: a simulation as those see it who only read."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from ..scene.part import ConstraintBase, Interaction
from ..scene.scene import Scene
from ..scene.settings import Settings
from .model import Model
from .neighbors.lists import Neighbors
from .state import State


class Source(Protocol):
    """What recorders, histories and pictures read: a simulation has it, and so has its loop."""

    @property
    def scenes(self) -> Sequence[Scene]:
        """One for each world."""

    @property
    def settings(self) -> Settings:
        """With numbers for ``dt`` and ``substeps``."""

    @property
    def model(self) -> Model:
        """Worlds, device and precision."""

    @property
    def state(self) -> State:
        """The arrays on the device."""

    @property
    def neighbors(self) -> Neighbors:
        """The pair lists."""

    @property
    def interactions(self) -> Sequence[Interaction]:
        """Of all worlds, bound."""

    @property
    def constraints(self) -> Sequence[ConstraintBase]:
        """Of all worlds, bound."""

    @property
    def frame(self) -> int:
        """Frames since the start."""

    @property
    def time(self) -> float:
        """Since the start [s]."""

    def get(self, name: str) -> np.ndarray:
        """A per-particle array, copied to the host."""


class Runner(Source, Protocol):
    """A source that can be moved on."""

    def step(self) -> None:
        """Advance by one frame."""

    def reset(self) -> None:
        """Back to the start."""
