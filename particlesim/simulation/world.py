"""World: a view of one world of a simulation, and how arrays are read and written by name."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import validate
from ..engine.loop import Loop
from ..scene.scene import Scene
from .writer import Writer


class Access:
    """Per-particle arrays by name: a member says which rows."""

    def get(self, name: str) -> np.ndarray:
        """A per-particle array, copied to the host."""
        raise NotImplementedError

    def set(self, name: str, value: Any) -> None:
        """Write a per-particle array; what was derived from it is forgotten."""
        raise NotImplementedError

    @property
    def position(self) -> np.ndarray:
        """Positions, (n, 3), a copy on the host; of all worlds, one after the other."""
        return self.get("position")

    @position.setter
    def position(self, value: Any) -> None:
        self.set("position", value)

    @property
    def velocity(self) -> np.ndarray:
        """Velocities, (n, 3), a copy on the host; of all worlds, one after the other."""
        return self.get("velocity")

    @velocity.setter
    def velocity(self, value: Any) -> None:
        self.set("velocity", value)


class World(Access):
    """One world of a batch: its rows of the simulation's arrays."""

    def __init__(self, loop: Loop, writer: Writer, index: int):
        count = loop.model.world_count
        validate.whole("Simulation.world", "index", index)
        if index >= count:
            raise validate.fail(
                "Simulation.world", "index", f"be from 0 to {count - 1}", index,
                "name a world of this simulation",
            )  # fmt: skip
        self._loop, self._writer, self.index = loop, writer, index
        self.rows = loop.model.rows(index)

    @property
    def scene(self) -> Scene:
        """The scene that the world was made of."""
        return self._loop.scenes[self.index]

    def get(self, name: str) -> np.ndarray:
        """A per-particle array of this world, copied to the host."""
        array = self._loop.state[name]
        if self.rows.start == self.rows.stop:  # Warp has no empty slice at an array's end
            return array.numpy()[self.rows].copy()
        return array[self.rows].numpy().copy()

    def set(self, name: str, value: Any) -> None:
        """Write a per-particle array of this world."""
        self._writer.set(name, value, self.rows)

    def reset(self) -> None:
        """Put this world back to its start."""
        self._writer.reset([self.index])
