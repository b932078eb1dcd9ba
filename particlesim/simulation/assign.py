"""Writing into a running simulation: values of particles, and worlds back to their start."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import validate
from ..instruments.ledger.accounts import motion

if TYPE_CHECKING:
    from .simulation import Simulation


def assign_rows(sim: Simulation, name: str, value: Any, rows: slice) -> None:
    """Write rows of a per-particle array (see :meth:`Simulation.set`)."""
    owner, state = "Simulation.set", sim.state
    array = state[name]
    host = array.numpy().copy()
    shape = host[rows].shape
    width = shape[1] if len(shape) == 2 else None
    host[rows] = validate.rows(owner, name, value, shape[0], width)
    if name == "mass":
        _check_mass(host, rows)
    largest = sim.model.column("radius").max() if name == "radius" else np.inf
    if name == "radius" and host.max() > largest:
        raise validate.fail(
            owner, "radius", "be at most the largest at the start, which contacts are looked for "
            f"by ({largest:g})", float(host.max()), "give the scene the largest that it will have",
        )  # fmt: skip
    before = None if sim.accounts is None else motion(sim.model, state)
    array.assign(host)
    if name == "mass":
        _invert(sim, host, rows)
    if sim.accounts is not None and before is not None:
        sim.accounts.written(before)
    error = f"{name}_error"
    if error in state:
        kept = state[error].numpy().copy()
        kept[rows] = 0
        state[error].assign(kept)
    worlds = np.unique(sim.model.world_of[rows]).tolist()
    if name == "position":
        sim.neighbors.renew(state, worlds)
        for constraint in sim.constraints:
            constraint.placed(worlds)
    if name in ("position", "velocity"):
        sim.watchdog.placed(sim, worlds)
    sim._unknown_forces.update(worlds)


def _check_mass(mass: np.ndarray, rows: slice) -> None:
    if not (mass[rows] > 0).all():
        raise validate.fail(
            "Simulation.set", "mass", "be above 0", float(mass[rows].min()), "give a mass"
        )


def _invert(sim: Simulation, mass: np.ndarray, rows: slice) -> None:
    """Have the inverse masses follow the masses; pinned particles stay pinned."""
    if "inverse_mass" in sim.state:
        inverse = sim.get("inverse_mass")
        inverse[rows] = np.where(inverse[rows] > 0, 1.0 / mass[rows], 0.0)
        sim.state.inverse_mass.assign(inverse)


def reset_worlds(sim: Simulation, worlds: Iterable[int] | None) -> None:
    """Put worlds back to their start (see :meth:`Simulation.reset`)."""
    owner, count = "Simulation.reset", sim.world_count
    given = range(count) if worlds is None else worlds
    given = given if isinstance(given, Iterable) else [given]
    chosen = sorted({validate.whole(owner, "worlds", w) for w in given})
    if chosen and chosen[-1] >= count:
        raise validate.fail(
            owner, "worlds", f"be from 0 to {count - 1}", chosen[-1],
            "name worlds of this simulation",
        )  # fmt: skip
    if len(chosen) == count:
        sim.frame = 0
    sim.state.reset(chosen)
    sim.neighbors.renew(sim.state, chosen)
    for part in [*sim.interactions, *sim.constraints]:
        part.reset(chosen)
    sim.watchdog.reset(sim, chosen)
    if sim.accounts is not None:
        sim.accounts.begin_anew(chosen)
    sim._unknown_forces.update(chosen)
