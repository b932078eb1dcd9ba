"""Reaches of particles' own: each looks as far as it says, and that changes in time."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ...kernels.engine.neighbors.own_reach import grown_kernel, own_reach_kernels, spreading_kernels
from ..execution.launch import launch
from ..model import Model
from ..state import State


class OwnReach:
    """How far each particle of a list looks: i and j are listed within the farther of the two.

    A particle's reach is taken when rows are made, from a size of it that is an array of the state,
    with room for it to grow; they are made anew once half of that is used up.

    Args:
        size: Name of the array of the state.
        factor: Of what a particle reaches over its size.
        growth: Of a size until its reach is no longer enough.
        first: Sizes at the start, (n,) over all particles [length].
        most: No reach is longer, (worlds,) [length].
    """

    def __init__(
        self, size: str, factor: float, growth: float, first: np.ndarray, most: np.ndarray
    ):
        self.size, self.factor, self.first, self.most_host = size, factor * growth, first, most
        self.room = factor * 0.5 * (1.0 + growth)
        self.reach: wp.array  # that rows were made with, (n,)

    def typical(self, members: np.ndarray, model: Model) -> np.ndarray:
        """The reach that most have, (worlds,)."""
        world, reach = model.world_of[members], self.factor * self.first[members]
        found = [np.median(reach[world == w]) if (world == w).any() else 0.0
                 for w in range(model.world_count)]  # fmt: skip
        return np.minimum(np.array(found, dtype=np.float64), self.most_host)

    def allocate(self, listed: Any, state: State) -> None:
        """Once, before the first rows."""
        self.listed, self.state, model = listed, state, listed.model
        sizes, members = state[self.size].numpy().copy(), listed.members_host
        sizes[members] = self.first[members]
        state[self.size].assign(sizes)
        self.reach = wp.zeros_like(state[self.size])
        self.most = model.array(self.most_host, wp.float64)
        self.longest = wp.zeros(model.world_count, dtype=wp.float32, device=model.device)
        self.kernels = own_reach_kernels(model.precision)

    def flag(self) -> None:
        """Mark worlds in which a size has used up half of its room.

        Whose list it is does so before the forces of a substep, and nowhere else: rows are then
        made at the same moments, whatever was looked at in between.
        """
        listed = self.listed
        inputs = [listed.members, listed.world, self.most, self.room, self.state[self.size],
                  self.reach, listed.moved, listed.any_moved]  # fmt: skip
        launch(grown_kernel(listed.model.precision), listed.count, inputs, listed.model.device)

    def take(self) -> None:
        """Reaches of the worlds marked as moved, from their present sizes."""
        listed = self.listed
        inputs = [listed.members, listed.world, listed.moved, self.most, self.factor,
                  self.state[self.size], self.reach]  # fmt: skip
        launch(self.kernels.take, listed.count, inputs, listed.model.device)

    def set_cutoffs(self) -> None:
        """Cutoffs of the worlds marked as moved."""
        listed, device = self.listed, self.listed.model.device
        inputs = [listed.members, listed.world, listed.moved, self.reach, self.longest]
        launch(self.kernels.longest, listed.count, inputs, device)
        inputs = [listed.moved, self.longest, listed.struct]
        launch(self.kernels.cutoffs, listed.model.world_count, inputs, device)

    def spread(self, planes: wp.array, supers: Any = None, count: int = 0) -> None:
        """With the skin by slot, and by as many supers, where there are any."""
        listed, device = self.listed, self.listed.model.device
        kernels = spreading_kernels(listed.model.precision)
        inputs = [listed.world, listed.skin.struct, listed.order, self.reach, planes]
        launch(kernels.slots, listed.count, inputs, device)
        if supers is not None:
            launch(kernels.supers, count, [listed.count, planes, supers], device)
