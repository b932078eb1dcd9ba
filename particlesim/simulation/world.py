"""World: a view of one world of a simulation, and how arrays are read and written by name."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import validate
from ..engine.loop import Loop
from ..scene.scene import Scene
from .writer import Writer


class Copy(np.ndarray):
    """What was read, and cannot be written to: that would change nothing in the simulation.

    Arithmetic makes plain arrays of it, also ``+=``, whose result is then assigned. ``copy()``
    makes one that may be written to.
    """

    @classmethod
    def of(cls, values: np.ndarray) -> Copy:
        """These values, no longer to be written to."""
        result = values.view(cls)
        result.flags.writeable = False
        return result

    def __array_ufunc__(
        self, ufunc: np.ufunc, method: str, *inputs: Any, out: Any = None, **options: Any
    ) -> Any:
        if out is not None:
            kept = [None if each is self and not self.flags.writeable else each for each in out]
            if any(each is not None for each in kept):
                options["out"] = tuple(_plain(each) for each in kept)
        result = getattr(ufunc, method)(*(_plain(each) for each in inputs), **options)
        return out[0] if out is not None and "out" in options and len(out) == 1 else result


def _plain(value: Any) -> Any:
    return value.view(np.ndarray) if isinstance(value, Copy) else value


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
        """Positions, (n, 3), a copy on the host; of all worlds, one after the other.

        ``sim.position = x`` and ``sim.position += d`` write; ``sim.position[0] = x`` would write
        into the copy, so that NumPy refuses it.
        """
        return Copy.of(self.get("position"))

    @position.setter
    def position(self, value: Any) -> None:
        self.set("position", value)

    @property
    def velocity(self) -> np.ndarray:
        """Velocities, (n, 3), a copy on the host, like :attr:`position`."""
        return Copy.of(self.get("velocity"))

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
