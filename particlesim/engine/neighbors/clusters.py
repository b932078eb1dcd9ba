"""Rows for the CPU: one for each cluster of four slots that are near each other."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import warp as wp

from ...kernels.engine.neighbors.clusters import halving_kernels, supers_type
from ...kernels.engine.neighbors.columns import (
    LINE,
    SUPER,
    columns_type,
    lay_kernel,
    number_kernel,
    sort_kernel,
)  # fmt: skip
from ...kernels.engine.neighbors.partners import (
    HERE,
    LEAST,
    ROUNDED,
    Pool,
    partners_kernel,
    pools_kernel,
)
from ...kernels.engine.packed import AHEAD, CLUSTER
from ..execution.launch import call, launch, when
from ..model import Model
from .blocks import Block
from .cells import slowest_last

# What a world's pool holds: so many times, and entries beyond, what is found at the start; and so
# many times what is found once it was full, since there may be more and more.
ROOM, SPARE, MORE = 1.1, 256, 1.2
BINS_PER_PARTICLE = 0.75  # bounds the cost of clearing a grid; evenly spread, they take a half
PADDING = 2 * SUPER  # planes may be read beyond their end


def leads(blocks: list[Block], size: int) -> np.ndarray:
    """First slots of groups of so many, which begin anew with every block."""
    return np.concatenate([np.arange(block.begin, block.end, size) for block in blocks])


class ClusterRows:
    """Makes the rows of a list: four slots share one.

    Args:
        listed: The list; its blocks, members and positions are known.
        large: By world, whether it is sorted by a grid.
    """

    def __init__(self, listed: Any, large: np.ndarray):
        self.listed, self.model = listed, listed.model
        model, blocks = self.model, listed.blocks
        device, precision = model.device, model.precision
        self.large = [k for k, each in enumerate(blocks) if large[each.world] and each.count]
        self.small = [k for k, each in enumerate(blocks) if not large[each.world] and each.count]
        self.pools = np.zeros(model.world_count, dtype=np.int64)  # entries
        self.rows = Pool()
        self.made = 0  # times: for as many as was guessed, for those of the start, for more
        axes = 3 if listed.own is None else 4  # behind the coordinates, reaches
        size = (axes, listed.count + PADDING)
        self.planes = wp.zeros(size, dtype=precision.scalar, device=device)
        self.supers = self._supers()
        most = {k: max(64, int(BINS_PER_PARTICLE * blocks[k].count)) for k in self.large}
        self.columns = self._columns(most)
        self.starts = wp.zeros(sum(most.values()) + len(most), dtype=wp.int32, device=device)
        self.bins = wp.zeros(listed.count if most else 0, dtype=wp.int32, device=device)
        # What a grid sorts stands where the sorted coordinates come to be.
        self.places = wp.array(
            ptr=self.planes.ptr, shape=listed.count, dtype=wp.vec3f, device=device
        )
        self.grids = {}
        for k in self.large:
            grid = wp.HashGrid(LINE, -(-most[k] // LINE), 1, device=device)
            grid.reserve(blocks[k].count)
            self.grids[k] = grid, self.places[blocks[k].begin : blocks[k].end]

    def _supers(self) -> Any:
        model, blocks = self.model, self.listed.blocks
        counts = np.array([-(-block.count // SUPER) for block in blocks])
        four = np.array([-(-block.count // CLUSTER) for block in blocks])
        first = np.concatenate([[0], np.cumsum(counts)])
        block_of = np.repeat(np.arange(len(blocks)), counts)
        within = np.arange(first[-1]) - first[block_of]
        result = supers_type(model.precision)()
        result.lead = model.array(leads(blocks, SUPER), wp.int32)
        result.block = model.array(block_of, wp.int32)
        result.first = model.array(first, wp.int32)
        begin = np.concatenate([[0], np.cumsum(four)])
        result.cluster = model.array(begin[block_of] + SUPER // CLUSTER * within, wp.int32)
        size = (len(self.planes), int(first[-1]) + SUPER)
        for name in ("middle", "half"):
            planes = wp.zeros(size, dtype=model.precision.scalar, device=model.device)
            setattr(result, name, planes)
        self.super_count = int(first[-1])
        return result

    def _columns(self, most: dict[int, int]) -> wp.array:
        model, blocks = self.model, self.listed.blocks
        start = self.listed.x_listed.numpy().astype(np.float64)
        axes, backward = np.zeros((2, len(blocks), 3), dtype=np.int32)
        for k in self.large:
            axes[k], backward[k] = slowest_last(start[blocks[k].begin : blocks[k].end])
        room = np.array([most.get(k, 0) for k in range(len(blocks))])
        columns: dict[str, Any] = {
            "begin": np.array([block.begin for block in blocks]),
            "end": np.array([block.end for block in blocks]),
            "world": np.array([block.world for block in blocks]),
            "axes": axes, "backward": backward, "wraps": np.array(list(model.periodic))[axes],
            "first": np.cumsum([0, *(room + (room > 0))])[:-1], "most": room,
        }  # fmt: skip
        return model.structures(columns_type(model.precision), columns)

    @staticmethod
    def clusters(model: Model, blocks: list[Block]) -> np.ndarray:
        """First slots of the clusters, and of one more."""
        return np.append(leads(blocks, CLUSTER), sum(block.count for block in blocks))

    def make_room(self, found: np.ndarray) -> int:
        """Pools for as many as were found, by cluster, and more; returns how many entries."""
        model, listed = self.model, self.listed
        entries = -(-found // ROUNDED) * ROUNDED
        # A row that has grown n-fold has left what it had on the way, 2 + 4 + ... + n.
        folds = 2 ** np.ceil(np.log2(np.maximum((found + LEAST) / HERE, 1))).astype(np.int64)
        entries = np.where(folds > 1, (2 * folds - 2) * HERE, entries)
        world = np.repeat([block.world for block in listed.blocks], np.diff(listed.edges))
        wanted = np.bincount(world, entries, minlength=model.world_count)
        if self.made:  # in any substep of the frame, of which the last is what was found
            wanted = np.maximum(wanted, np.maximum(self.rows.most.numpy(), self.rows.taken.numpy()))
        room = np.where(wanted > self.pools, MORE if self.made > 1 else ROOM, 1.0)
        wanted = np.where(wanted > 0, np.ceil(room * wanted) + SPARE, 0).astype(np.int64)
        self.pools = np.maximum(self.pools, wanted)
        self.made += 1
        first = np.concatenate([[0], np.cumsum(self.pools)])
        listed.pairs.row = wp.zeros(len(found), dtype=wp.int64, device=model.device)
        listed.pairs.entry_stride = 1
        self.rows = Pool()
        self.rows.first = model.array(first, wp.int64)
        self.rows.taken, self.rows.most = (
            wp.zeros(model.world_count, dtype=wp.int32, device=model.device) for _ in range(2)
        )
        return int(first[-1]) + AHEAD

    @property
    def capacity(self) -> int:
        """Entries that there is room for, by row."""
        return int(self.pools.sum() // max(1, self.listed.rows))

    def rebuild(self) -> None:
        """Make the rows of the worlds marked as moved."""
        model, listed, device = self.model, self.listed, self.model.device
        for stage in (self._number, self._sort):
            for k in self.large:
                w = listed.blocks[k].world
                with when(listed.moved[w : w + 1]):
                    stage(k)
        halve = halving_kernels(model.precision, model.periodic)
        if self.small:
            launch(
                halve.blocks,
                len(listed.blocks),
                [listed.moved, self.columns, listed.box, listed.members, listed.x_listed,
                 listed.order, self.planes],
                device,
            )  # fmt: skip
        launch(pools_kernel(), model.world_count, [listed.moved, self.rows], device)
        slots = self.super_count * SUPER
        inputs = [listed.moved, self.columns, listed.box, self.supers, listed.order, self.planes]
        launch(halve.supers, slots, inputs, device, SUPER)
        if listed.own is not None:
            listed.own.spread(self.planes, self.supers, self.super_count)
        launch(
            partners_kernel(model.precision, model.periodic, listed.own is not None),
            slots,
            [listed.moved, listed.box, listed.struct, self.columns, self.starts, self.supers,
             self.rows, self.planes, listed.pairs, listed.found, listed.overflow],
            device,
            SUPER,
        )  # fmt: skip

    def _number(self, k: int) -> None:
        """The columns of a large block, and which of their bins its members are in."""
        listed, device = self.listed, self.model.device
        block, (grid, places) = listed.blocks[k], self.grids[k]
        precision = self.model.precision
        launch(lay_kernel(precision), 1, [k, listed.box, listed.x_listed, self.columns], device)
        inputs = [k, self.columns, listed.x_listed, self.bins, self.places]
        launch(number_kernel(precision), block.count, inputs, device)
        call(functools.partial(grid.build, places, 1.0))

    def _sort(self, k: int) -> None:
        """Slots of a large block in the order of its columns."""
        listed, device, precision = self.listed, self.model.device, self.model.precision
        block, (grid, _) = listed.blocks[k], self.grids[k]
        launch(
            sort_kernel(precision),
            block.count,
            [
                grid.id,
                k,
                self.columns,
                self.bins,
                listed.members,
                listed.x_listed,
                listed.order,
                self.planes,
                self.starts,
            ],
            device,
        )

    def describe(self) -> str:
        """How partners are looked for."""
        if not self.large:
            return f"clusters of {CLUSTER}"
        dims = self.columns.numpy()["dims"][self.large[0]]
        more = f" and {len(self.large) - 1} more" if len(self.large) > 1 else ""
        return f"clusters of {CLUSTER}, hash grid {dims[1]} x {dims[2]} columns of {dims[0]}{more}"

    @property
    def arrays(self) -> list[wp.array]:
        """What it holds."""
        supers = [self.supers.lead, self.supers.block, self.supers.cluster, self.supers.middle,
                  self.supers.half]  # fmt: skip
        return [self.planes, self.starts, self.bins, *supers]
