"""What is read of scenes in motion, and what can move them on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from ..scene.constraint_base import ConstraintBase
from ..scene.part import Interaction
from ..scene.scene import Scene
from ..scene.settings import Settings
from .limit import Limit
from .model import Model
from .neighbors.lists import Neighbors
from .state import State


class Source(Protocol):
    """What recorders, histories and pictures read: a simulation has it, and so has its loop."""

    scenes: Sequence[Scene]  # one for each world
    model: Model
    state: State
    neighbors: Neighbors
    interactions: Sequence[Interaction]  # of all worlds, bound
    constraints: Sequence[ConstraintBase]

    @property
    def settings(self) -> Settings:
        """The knobs, with numbers for all."""

    @property
    def limiter(self) -> Limit | None:
        """What the number of substeps was chosen by, where it is adaptive."""

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
