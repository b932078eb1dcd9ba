"""How the bodies of a tree come into its order (see ``kernels/interactions/tree/order.py``)."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import warp as wp

from ...engine.execution.launch import call, launch
from ...engine.model import Model
from ...engine.state import State
from ...kernels.interactions.tree import order

Levels = list[tuple[int, int]]


class Order:
    """Base: three lists of the bodies, by x, y and z, of which the first gives the order.

    Args:
        model: The worlds.
        members: Rows of the bodies, world by world.
        levels: First node and number of nodes of each level.
        data: What is known of the nodes.
    """

    def __init__(self, model: Model, members: np.ndarray, levels: Levels, data: Any):
        self.model, self.levels, self.data, self.count = model, levels, data, len(members)
        self.members = model.array(members, wp.int32)
        self.by = self._integers(6 * self.count)  # and room for sorts behind each
        self.keys = self._integers(6 * self.count)
        self.sides = self._integers(model.particle_count)

    def _integers(self, count: int) -> wp.array:
        return wp.zeros(count, dtype=wp.int32, device=self.model.device)

    def place(self, state: State) -> None:
        """Find the order of the bodies where they are now."""
        raise NotImplementedError


class NativeOrder(Order):
    """On a CPU: worlds are sorted, and nodes are halved, each by itself, in C++."""

    def __init__(self, model: Model, members: np.ndarray, levels: Levels, data: Any):
        super().__init__(model, members, levels, data)
        self.spares = self._integers(3 * self.count)

    def place(self, state: State) -> None:
        precision, device, slots = self.model.precision, self.model.device, self.count
        sort, part = (order.native_kernel(precision, name) for name in ("sort", "part"))
        inputs = [slots, self.data, self.members, state.position, self.by, self.keys, self.spares,
                  self.sides]  # fmt: skip
        rows = 3 * self.model.world_count
        block = -(-3 * slots // rows)
        launch(sort, rows * block, [0, *inputs], device, block)
        for start, count in self.levels[:-1]:
            block = -(-slots // count)
            launch(part, count * block, [start, *inputs], device, block)


class SortedOrder(Order):
    """Elsewhere: all nodes of a level are halved by stable sorts."""

    def __init__(self, model: Model, members: np.ndarray, levels: Levels, data: Any):
        super().__init__(model, members, levels, data)
        n, device = self.count, model.device
        world = model.world_of[members]
        self.root = model.array(data.root.numpy()[world], wp.int32)
        first = np.zeros(model.particle_count, dtype=int)  # slot of its world
        first[members] = np.searchsorted(world, world)
        self.first = model.array(first, wp.int32)
        self.at = self._integers(n)  # slot -> node
        self.lists = [self.by[2 * n * k : 2 * n * (k + 1)] for k in range(3)]
        self.reals = wp.array(ptr=self.keys.ptr, shape=2 * n, dtype=wp.float32, device=device)

    def place(self, state: State) -> None:
        precision, device, n = self.model.precision, self.model.device, self.count
        made = order.sorted_kernels(precision)
        for axis, each in enumerate(self.lists):
            inputs = [axis, self.members, state.position, self.reals, each]
            launch(made.coordinates, n, inputs, device)
            _sort(self.reals, each, n)
            self._sort_by(self.first, each)
        wp.copy(self.at, self.root)
        for _ in self.levels[:-1]:
            inputs = [n, self.data, self.at, state.position, self.by, self.sides]
            launch(made.halves, n, inputs, device)
            for each in self.lists:
                self._sort_by(self.sides, each)
            launch(made.descend, n, [self.data, self.at], device)

    def _sort_by(self, slot: wp.array, bodies: wp.array) -> None:
        """Bodies by these of their slots, those of one as they stand."""
        kernel = order.sorted_kernels(self.model.precision).keys
        launch(kernel, self.count, [bodies, slot, self.keys], self.model.device)
        _sort(self.keys, bodies, self.count)


def _sort(keys: wp.array, values: wp.array, count: int) -> None:
    call(functools.partial(wp.utils.radix_sort_pairs, keys, values, count))
