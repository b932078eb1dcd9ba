"""Which rows of a simulation's arrays belong to which world: to take a world's present, and put it.

The arrays are those of a checkpoint: the state's, what a snapshot keeps besides, and what
constraints offer for reading.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from ..output.checkpoint import contents

if TYPE_CHECKING:
    import warp as wp

    from ..simulation.simulation import Simulation

Rows = dict[str, tuple[np.ndarray, np.ndarray]]  # by array: which rows, and what is in them


def arrays_by_world(sim: Simulation) -> dict[str, tuple[wp.array, np.ndarray]]:
    """The arrays by their names in a checkpoint, each with the world of every row."""
    result = {}
    for name, array in contents(sim).items():
        world = _worlds(sim, name, array)
        if world is not None:
            result[name] = (array, world)
    return result


def _worlds(sim: Simulation, name: str, array: wp.array) -> np.ndarray | None:
    """The world of each row of one array; None: its rows are no world's own."""
    model = sim.model
    kind, _, rest = name.partition("/")
    if kind == "state" or rest in sim.state:
        return np.arange(model.world_count) if rest == "time" else model.world_of
    owner, _, rest = rest.partition("_")
    if owner == "ledger" and sim.accounts is not None:
        return sim.accounts.worlds(rest)
    index, _, rest = rest.partition("_")
    if owner == "neighbors":
        return model.world_of[sim.neighbors.verlet[int(index)].members_host]
    return sim.constraints[int(index)].worlds(rest, array)


def take(sim: Simulation, worlds: Iterable[int]) -> Rows:
    """What is now in the rows of these worlds, on the host."""
    chosen = list(worlds)
    result = {}
    for name, (array, world) in arrays_by_world(sim).items():
        rows = np.nonzero(np.isin(world, chosen))[0]
        result[name] = (rows, array.numpy()[rows].copy())
    return result


def put(sim: Simulation, taken: Rows, factors: dict[str, float] | None = None) -> None:
    """Write back what was taken; neighbour rows are made anew from the positions listed.

    Args:
        sim: The simulation.
        taken: What :func:`take` returned.
        factors: By ends of names, what to multiply with.
    """
    arrays = arrays_by_world(sim)
    touched: set[int] = set()
    for name, (rows, values) in taken.items():
        array, world = arrays[name]
        host: Any = array.numpy().copy()
        scale = next((f for end, f in (factors or {}).items() if name.endswith(end)), None)
        host[rows] = values if scale is None else values * scale
        array.assign(host)
        touched.update(np.unique(world[rows]).tolist())
    for each in sim.neighbors.verlet:
        each.mark(sorted(touched))
        each.rebuild()
        each.grow()
