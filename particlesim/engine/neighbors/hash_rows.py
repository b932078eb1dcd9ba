"""Rows for CUDA: one for each slot, found through hash grids or by looking at a whole world."""

from __future__ import annotations

import functools
import itertools
from typing import Any

import numpy as np
import warp as wp

from ...kernels.engine.neighbors import renewal as kernels
from ...kernels.engine.neighbors import rows
from ...kernels.engine.neighbors.boxes import scaled_cells_kernel
from ...kernels.warp_internals import grid_shape
from ..execution.launch import call, launch, when
from ..model import Model
from .blocks import Block
from .cells import grid_over

SPARE = 8  # entries that a row has room for beyond a quarter more than there are


class HashRows:
    """Makes the rows of a list: every slot is a cluster of its own.

    Args:
        listed: The list; its blocks, members and positions are known.
        large: By world, whether it has grids.
    """

    def __init__(self, listed: Any, large: np.ndarray):
        self.listed, self.model = listed, listed.model
        model, count = self.model, listed.count
        real, vec3, device = model.precision.scalar, model.precision.vec3, model.device
        self.room = np.zeros(len(listed.blocks), dtype=int)
        used = np.array([large[block.world] for block in listed.blocks], dtype=bool)
        sizes = np.array([block.count for block in listed.blocks])
        small = (listed.cutoff > 0) & ~large
        self.has_direct, self.direct = bool(small.any()), model.array(small, wp.int32)
        self.slot = wp.zeros(count, dtype=wp.int32, device=device)
        self.cell_coordinate = wp.zeros(count, dtype=vec3, device=device)
        axes = 3 if listed.own is None else 4  # behind the coordinates, reaches
        self.planes = wp.zeros((axes, count), dtype=real, device=device)
        self.grids: dict[int, tuple[wp.HashGrid, Any]] = {}  # by block
        start = listed.x_listed.numpy().astype(np.float64)
        for k in np.nonzero(used & (sizes > 0))[0].tolist():
            block = listed.blocks[k]
            own = block.own + listed.skin.first[block.world]
            self.grids[k] = grid_over(model, block, own, start[block.begin : block.end])

    @staticmethod
    def clusters(model: Model, blocks: list[Block]) -> np.ndarray:
        """First slots of the clusters, and of one more."""
        return np.arange(sum(block.count for block in blocks) + 1)

    def make_room(self, found: np.ndarray) -> int:
        """Rows for as many as were found, by slot, and more; returns how many entries.

        Where they would have fitted, longer ones were full in an earlier substep. They are
        interleaved, so that neighbouring threads read neighbouring entries; those of blocks by size
        are contiguous, as they are of very different lengths.
        """
        model, listed = self.model, self.listed
        longest = [found[a:b].max(initial=0) for a, b in itertools.pairwise(listed.edges)]
        full = np.array(longest) > self.room
        full |= not full.any()
        longer = (1.25 * np.maximum(longest, self.room) + SPARE).astype(int)
        self.room = np.where(full, -(-longer // 16) * 16, self.room)
        counts = np.diff(listed.edges)
        apart = len(counts) > model.world_count
        if not apart:
            self.room[:] = self.room.max()
        row = np.concatenate([[0], np.cumsum(np.repeat(self.room, counts))])
        total = int(row[-1])
        if not apart:
            row = np.arange(listed.count + 1)
        listed.struct.room = model.array(self.room, wp.int32)
        listed.pairs.row = model.array(row[:-1], wp.int64)
        listed.pairs.entry_stride = 1 if apart else max(1, listed.count)
        return total

    @property
    def capacity(self) -> int:
        """Entries that the longest rows have room for."""
        return int(self.room.max())

    def rebuild(self) -> None:
        """Make the rows of the worlds marked as moved."""
        for w in sorted({self.listed.blocks[k].world for k in self.grids}):
            with when(self.listed.moved[w : w + 1]):
                self._from_grids(w)
        if self.has_direct:
            self._directly()

    def _from_grids(self, w: int) -> None:
        model, listed, device = self.model, self.listed, self.model.device
        mine = [(listed.blocks[k], *grid) for k, grid in self.grids.items()]
        mine = [each for each in mine if each[0].world == w]
        boxes = [listed.box] if model.flexible else []
        to_cells = kernels.cell_coordinates_kernel(model.precision)
        if model.flexible:
            to_cells = scaled_cells_kernel(model.precision)
        sort = kernels.sorting_kernels(model.precision).sort_slots
        for block, grid, place in mine:
            u = self.cell_coordinate[block.begin : block.end]
            inputs = [place, *boxes, listed.x_listed, self.cell_coordinate]
            launch(to_cells, block.count, inputs, device)
            call(functools.partial(grid.build, u, 1.0))
            launch(
                sort,
                block.count,
                [grid.id, place, listed.members, listed.x_listed, listed.order, self.slot,
                 self.planes],
                device,
            )  # fmt: skip
        if listed.own is not None:
            listed.own.spread(self.planes)
        own = listed.own is not None
        make = rows.grid_rows_kernel(model.precision, model.periodic, model.flexible, own)
        for block, _, _ in mine:
            for k, (other, grid, place) in enumerate(mine):
                thick = listed.skin.first[w]
                reach = block.cutoff[k] + thick
                launch(
                    make,
                    block.count,
                    [grid.id, place, block.begin, reach / (other.own + thick), int(k > 0),
                     listed.box, reach**2, listed.struct, self.slot, self.planes, listed.pairs,
                     listed.found, listed.overflow],
                    device,
                )  # fmt: skip

    def _directly(self) -> None:
        model, listed = self.model, self.listed
        spread = kernels.sorting_kernels(model.precision).spread
        launch(spread, listed.count, [listed.x_listed, self.planes], model.device)
        if listed.own is not None:
            listed.own.spread(self.planes)
        launch(
            rows.direct_rows_kernel(model.precision, model.periodic, listed.own is not None),
            listed.count,
            [self.direct, listed.box, listed.moved, listed.struct, self.planes, listed.pairs,
             listed.found, listed.overflow],
            model.device,
        )  # fmt: skip

    def describe(self) -> str:
        """How partners are looked for."""
        grids = ["{} x {} x {}".format(*grid_shape(grid)) for grid, _ in self.grids.values()]
        how = f"hash grid {grids[0]}" if grids else "direct search"
        return how + (f" and {len(grids) - 1} more" if len(grids) > 1 else "")

    @property
    def arrays(self) -> list[wp.array]:
        """What it holds."""
        return [self.slot, self.cell_coordinate, self.planes]
