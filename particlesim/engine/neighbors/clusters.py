"""Rows for the CPU: one for each cluster of four slots that are near each other."""

from __future__ import annotations

import functools
import itertools
from typing import Any

import numpy as np
import warp as wp

from ...kernels.engine.clusters import halving_kernels, supers_type
from ...kernels.engine.columns import (
    LINE,
    SUPER,
    columns_type,
    lay_kernel,
    number_kernel,
    sort_kernel,
)  # fmt: skip
from ...kernels.engine.packed import AHEAD, CLUSTER
from ...kernels.engine.partners import LEAST, Attic, attics_kernel, partners_kernel
from ..execution.launch import call, launch, when
from ..model import Model
from .blocks import Block
from .cells import slowest_last

USUAL = 0.98  # of the rows are no longer than rows usually are
ROOM = 1.2  # times that is what they have room for
SPARE = 0.03  # of all rows: what the attic has beyond what is in it
BINS_PER_PARTICLE = 2  # bounds the cost of clearing a grid
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
        self.room, self.attics = np.zeros(len(blocks), dtype=int), np.zeros(model.world_count)
        self.planes = wp.zeros((3, listed.count + PADDING), dtype=precision.scalar, device=device)
        self.supers = self._supers()
        most = {k: max(64, BINS_PER_PARTICLE * blocks[k].count) for k in self.large}
        self.columns = self._columns(most)
        self.starts = wp.zeros(sum(most.values()) + len(most), dtype=wp.int32, device=device)
        self.bins = wp.zeros(listed.count if most else 0, dtype=wp.int32, device=device)
        self.places = wp.zeros(listed.count if most else 0, dtype=wp.vec3f, device=device)
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
        for name in ("middle", "half"):
            planes = wp.zeros(
                (3, int(first[-1]) + SUPER), dtype=model.precision.scalar, device=model.device
            )
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
        """Rows for as many as were found, by cluster, and more; returns how many entries.

        A few are much longer than others. They go on in the attic, at twice the length, until all
        are in; it is always made larger than it was.
        """
        model, listed = self.model, self.listed
        usual = [
            np.quantile(found[a:b], USUAL) if b > a else 0.0
            for a, b in itertools.pairwise(listed.edges)
        ]
        room = (np.ceil(np.array(usual) * ROOM / LEAST).astype(int) + 1) * LEAST
        room = np.maximum(room, self.room)
        counts = np.diff(listed.edges)
        wanted = 2 ** np.ceil(np.log2(np.maximum(ROOM * found / np.repeat(room, counts), 1)))
        # A row that has grown n-fold has left what it had on the way, 2 + 4 + ... + n.
        longer = np.where(wanted > 1, (2 * wanted - 2) * np.repeat(room, counts), 0)
        worlds = np.repeat([block.world for block in listed.blocks], counts)
        attics = np.bincount(worlds, longer, minlength=model.world_count)
        attics = attics + SPARE * np.bincount(
            worlds, np.repeat(room, counts), minlength=model.world_count
        )
        attics = np.where(attics > 0, np.maximum(attics, 1.5 * self.attics) + room.max(), 0.0)
        begin = np.concatenate([[0], np.cumsum(room * counts)])
        first = begin[-1] + np.concatenate([[0], np.cumsum(np.ceil(attics).astype(int))])
        struct = listed.struct
        struct.room = model.array(room, wp.int32)
        struct.row = model.array(begin[:-1], wp.int64)
        struct.cluster = model.array(listed.edges[:-1], wp.int32)
        listed.pairs.row = wp.zeros(len(found) + 2, dtype=wp.int64, device=model.device)
        listed.pairs.entry_stride = 1
        self.attic = Attic()
        self.attic.first = model.array(first, wp.int64)
        self.attic.taken = wp.zeros(model.world_count, dtype=wp.int32, device=model.device)
        self.room, self.attics = room, attics
        return int(first[-1]) + AHEAD

    def rebuild(self) -> None:
        """Make the rows of the worlds marked as moved."""
        model, listed, device = self.model, self.listed, self.model.device
        for k in self.large:
            w = listed.blocks[k].world
            with when(listed.moved[w : w + 1]):
                self._sort(k)
        halve = halving_kernels(model.precision, model.periodic)
        if self.small:
            launch(
                halve.blocks,
                len(listed.blocks),
                [listed.moved, self.columns, model.box, listed.members, listed.x_listed,
                 listed.order, self.planes],
                device,
            )  # fmt: skip
        launch(attics_kernel(), model.world_count, [listed.moved, self.attic.taken], device)
        slots = self.super_count * SUPER
        inputs = [listed.moved, self.columns, model.box, self.supers, listed.order, self.planes]
        launch(halve.supers, slots, inputs, device, SUPER)
        launch(
            partners_kernel(model.precision, model.periodic),
            slots,
            [listed.moved, model.box, listed.struct, self.columns, self.starts, self.supers,
             self.attic, self.planes, listed.pairs, listed.found, listed.overflow],
            device,
            SUPER,
        )  # fmt: skip

    def _sort(self, k: int) -> None:
        """Slots of a large block in the order of its columns."""
        listed, device = self.listed, self.model.device
        block, (grid, places) = listed.blocks[k], self.grids[k]
        precision = self.model.precision
        launch(lay_kernel(precision), 1, [k, self.model.box, listed.x_listed, self.columns], device)
        inputs = [k, self.columns, listed.x_listed, self.bins, self.places]
        launch(number_kernel(precision), block.count, inputs, device)
        call(functools.partial(grid.build, places, 1.0))
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
        return [self.planes, self.starts, self.bins, self.places, *supers]
