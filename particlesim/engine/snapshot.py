"""Snapshot: a frame's start on the device, to go back to when the frame must be done again."""

from __future__ import annotations

from typing import TYPE_CHECKING

import warp as wp

from ..kernels.engine.copy import copy_kernel
from .execution.launch import launch

if TYPE_CHECKING:
    from ..simulation.simulation import Simulation

# Made anew in every substep, or never changed: nothing to keep.
TRANSIENT = frozenset(
    {"mass", "inverse_mass", "radius", "world", "correction", "previous_position", "density",
     "pressure"}
)  # fmt: skip


class Snapshot:
    """Copies of what a substep starts from."""

    def __init__(self, sim: Simulation):
        # Not the simulation itself: it is to be let go as soon as nobody else holds it.
        self.verlet = sim.neighbors.verlet
        model, state = sim.model, sim.state
        skip = TRANSIENT | set(model.attributes) - {"position", "velocity"}
        if not sim.integrator.carries_forces:
            skip |= {"force"}
        self.arrays: dict[str, wp.array] = {
            name: array for name, array in state.arrays.items() if name not in skip
        }
        for k, each in enumerate(self.verlet):
            self.arrays[f"neighbors_{k}"] = each.x_listed
        for k, constraint in enumerate(sim.constraints):
            for name, array in constraint.persistent().items():
                self.arrays[f"constraint_{k}_{name}"] = array
        if sim.accounts is not None:
            for name, array in sim.accounts.persistent().items():
                self.arrays[f"ledger_{name}"] = array
        self.copies = {name: wp.clone(array) for name, array in self.arrays.items()}

    def take(self) -> None:
        """Copy the present; recorded as part of the frame."""
        for name, array in self.arrays.items():
            inputs = [array, self.copies[name]]
            launch(copy_kernel(array.dtype), len(array), inputs, array.device)

    def restore(self) -> None:
        """Go back; neighbour rows are made again from the positions that they were made from."""
        for name, array in self.arrays.items():
            wp.copy(array, self.copies[name])
        for each in self.verlet:
            each.mark_all()
            each.rebuild()
