"""World: a view of one world of a simulation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from . import validate
from .scene import Scene

if TYPE_CHECKING:
    from .simulation import Simulation


class World:
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

    @property
    def position(self) -> np.ndarray:
        """Positions, (n, 3), a copy on the host."""
        return self.get("position")

    @position.setter
    def position(self, value: Any) -> None:
        self.sim.set("position", value, self.rows)

    @property
    def velocity(self) -> np.ndarray:
        """Velocities, (n, 3), a copy on the host."""
        return self.get("velocity")

    @velocity.setter
    def velocity(self, value: Any) -> None:
        self.sim.set("velocity", value, self.rows)

    def get(self, name: str) -> np.ndarray:
        """A per-particle array of this world, copied to the host."""
        return self.sim.state[name][self.rows].numpy().copy()

    def reset(self) -> None:
        """Put this world back to its start."""
        self.sim.reset([self.index])
