"""World: a view of one world of a simulation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .. import validate
from ..scene.scene import Scene
from .access import Access

if TYPE_CHECKING:
    from .simulation import Simulation


class World(Access):
    """One world of a batch: its rows of the simulation's arrays."""

    def __init__(self, sim: Simulation, index: int):
        validate.whole("Simulation.world", "index", index)
        if index >= sim.world_count:
            raise validate.fail(
                "Simulation.world", "index", f"be from 0 to {sim.world_count - 1}", index,
                "name a world of this simulation",
            )  # fmt: skip
        self.sim, self.index = sim, index
        offsets = sim.model.offsets
        self.rows = slice(int(offsets[index]), int(offsets[index + 1]))

    @property
    def scene(self) -> Scene:
        """The scene that the world was made of."""
        return self.sim.scenes[self.index]

    def get(self, name: str) -> np.ndarray:
        """A per-particle array of this world, copied to the host."""
        array = self.sim.state[name]
        if self.rows.start == self.rows.stop:  # Warp has no empty slice at an array's end
            return array.numpy()[self.rows].copy()
        return array[self.rows].numpy().copy()

    def set(self, name: str, value: Any) -> None:
        """Write a per-particle array of this world."""
        self.sim.set(name, value, self.rows)

    def reset(self) -> None:
        """Put this world back to its start."""
        self.sim.reset([self.index])
