"""Snapshot: what outlives a substep, to go back to a frame's start, and world by world.

Names are those of a checkpoint: ``state/<name>`` is the state's array, ``kept/<name>`` what else a
substep starts from (the positions that neighbour rows were made from, broken links, slack, the
ledger's sums) and ``read/<name>`` what parts offer for reading.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import warp as wp

from ..scene.part import Part
from .execution.copies import copy
from .loop import Loop
from .observers import Observer
from .state import OF_WORLDS

# Made anew in every substep, or never changed: nothing to keep.
TRANSIENT = frozenset(
    {"mass", "inverse_mass", "radius", "world", "correction", "previous_position", "density",
     "pressure", "force_slope", "implicit_force", "velocity_lead", "half_velocity",
     "half_velocity_error"}
)  # fmt: skip
Rows = dict[str, tuple[np.ndarray, np.ndarray]]  # by array: which rows, and what is in them


class Snapshot:
    """Copies of what a substep starts from."""

    def __init__(self, loop: Loop):
        self.loop = loop
        model, state = loop.model, loop.state
        evolving = frozenset[str]().union(*(part.evolves for part in loop.parts))
        skip = TRANSIENT | set(model.attributes) - {"position", "velocity"} - evolving
        if not loop.integrator.carries_forces:
            skip |= {"force"}
        self.arrays: dict[str, wp.array] = {
            name: array for name, array in state.arrays.items() if name not in skip
        }
        for k, each in enumerate(loop.neighbors.verlet):
            for name, array in each.persistent().items():
                self.arrays[f"neighbors_{k}_{name}"] = array
        self._owners: dict[str, Part | Observer] = {
            **{f"interaction_{k}": part for k, part in enumerate(loop.interactions)},
            **{f"constraint_{k}": part for k, part in enumerate(loop.constraints)},
            **{f"thermostat_{k}": part for k, part in enumerate(loop.thermostats)},
            **{each.name: each for each in loop.observers.all},
        }
        for owner, part in self._owners.items():
            for name, array in part.persistent().items():
                self.arrays[f"{owner}_{name}"] = array
        self.copies = {name: wp.clone(array) for name, array in self.arrays.items()}

    def take(self) -> None:
        """Copy the present; recorded as part of the frame."""
        for name, array in self.arrays.items():
            copy(self.loop.model, array, self.copies[name])

    def restore(self) -> None:
        """Go back; neighbour rows are made again from the positions that they were made from.

        That a row was full since is undone with the rest.
        """
        for name, array in self.arrays.items():
            wp.copy(array, self.copies[name])
        for each in self.loop.neighbors.verlet:
            each.overflow.zero_()
            each.mark_all()
            each.rebuild()

    def contents(self) -> dict[str, wp.array]:
        """The arrays that a checkpoint holds, by their names in the file."""
        state = self.loop.state.arrays
        found = {f"state/{name}": array for name, array in state.items() if name != "world"}
        for name, array in self.arrays.items():
            if state.get(name) is not array:
                found[f"kept/{name}"] = array
        for owner, part in self._owners.items():
            for name, array in part.readable().items():
                found[f"read/{owner}_{name}"] = array
        return found

    # World by world ---------------------------------------------------------------------------

    def by_world(self) -> dict[str, tuple[wp.array, np.ndarray]]:
        """The arrays whose rows are worlds' own, each with the world of every row."""
        result = {}
        for name, array in self.contents().items():
            world = self._worlds(name, array)
            if world is not None:
                result[name] = (array, world)
        return result

    def _worlds(self, name: str, array: wp.array) -> np.ndarray | None:
        """The world of each row of one array; None: its rows are no world's own."""
        model = self.loop.model
        kind, _, rest = name.partition("/")
        if kind == "state" or rest in self.loop.state:
            return np.arange(model.world_count) if rest in OF_WORLDS else model.world_of
        for owner, part in self._owners.items():
            if rest.startswith(f"{owner}_"):
                return part.worlds(rest.removeprefix(f"{owner}_"), array)
        index, _, name = rest.removeprefix("neighbors_").partition("_")
        return self.loop.neighbors.verlet[int(index)].worlds(name)

    def rows(self, worlds: Iterable[int]) -> Rows:
        """What is now in the rows of these worlds, on the host."""
        chosen = list(worlds)
        result = {}
        for name, (array, world) in self.by_world().items():
            mine = np.nonzero(np.isin(world, chosen))[0]
            result[name] = (mine, array.numpy()[mine].copy())
        return result

    def put(self, rows: Rows, factors: dict[str, float]) -> None:
        """Write back what :meth:`rows` returned; neighbour rows are made anew.

        Args:
            rows: By array.
            factors: By ends of names, what to multiply with.
        """
        arrays = self.by_world()
        touched: set[int] = set()
        for name, (mine, values) in rows.items():
            array, world = arrays[name]
            host = array.numpy().copy()
            scale = next((f for end, f in factors.items() if name.endswith(end)), None)
            host[mine] = values if scale is None else values * scale
            array.assign(host)
            touched.update(np.unique(world[mine]).tolist())
        for each in self.loop.neighbors.verlet:
            each.mark(sorted(touched))
            each.rebuild()
            each.grow()
