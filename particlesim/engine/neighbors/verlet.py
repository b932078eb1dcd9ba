"""Verlet lists, built from ``wp.HashGrid`` or by looking at a whole world.

A list holds for every slot the slots nearer than cutoff + skin, and stays valid until a particle
has moved half the skin; then the lists of that particle's world are rebuilt, and of no other, so
that a world in a batch goes exactly as it goes alone. Worlds are kept apart by construction: a
large world has hash grids of its own, one for each of its blocks, a small one is looked through
directly.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...kernels.engine import neighbors as kernels
from ...kernels.engine import rows
from ...kernels.engine.loops import ROWS
from ...kernels.warp_internals import grid_shape
from ..execution.launch import call, launch, when
from ..model import Model
from ..state import State
from .all_pairs import AllPairs
from .blocks import blocks, blocks_struct
from .cells import grid_over

# Skin over cutoff, where Settings leaves it open; measured. Grains have few partners, so that rows
# cost little to hold and much to make.
SKIN, SKIN_OF_CONTACTS = 0.12, 0.2
DIRECT_CPU, DIRECT_CUDA = 512, 8192  # largest world that is looked through directly; measured


class VerletList(AllPairs):
    """Neighbour rows within cutoff + skin, per world."""

    partners = ROWS

    def __init__(self, model: Model, members: np.ndarray):
        super().__init__(model, members)
        self.cutoff = np.zeros(model.world_count)  # 0: nothing is looked for in that world
        # By world: of particles that differ much in size, half the cutoff of each; else None.
        self.half: list[np.ndarray | None] = [None] * model.world_count
        self.generation = 0
        self.grids: dict[int, tuple[wp.HashGrid, Any]] = {}  # by block

    def _choose_search(self) -> None:
        """Which worlds have a grid, and which are looked through directly."""
        sizes = (self.end_host - self.begin_host) * (self.cutoff > 0)
        limit = DIRECT_CPU if self.model.device.is_cpu else DIRECT_CUDA
        self.large, small = sizes > limit, (sizes > 0) & (sizes <= limit)
        self.has_direct = bool(small.any())
        self.direct = self.model.array(small, wp.int32)
        by_size = any(half is not None for half in self.half)
        self.sorted = self.sorted or bool(self.large.any()) or by_size

    def _cut(self) -> np.ndarray:
        """Cut the worlds into blocks; returns the members in the order of their slots."""
        set_skin = self.model.settings.skin
        share = np.where(self.for_interactions, SKIN, SKIN_OF_CONTACTS)
        skin = self.cutoff * share if set_skin is None else np.full_like(self.cutoff, set_skin)
        ranges, given = (self.begin_host, self.end_host), set_skin is not None
        cuts = list(blocks(*ranges, self.cutoff, skin, self.half, given=given))
        self.blocks = [block for _, of_world, _ in cuts for block in of_world]
        self.skin = np.array([thin for _, _, thin in cuts])
        self.reach = np.where(self.cutoff > 0, self.cutoff + self.skin, np.inf)
        self.struct = blocks_struct(self.model, [of_world for _, of_world, _ in cuts])
        return self.members_host[np.concatenate([order for order, _, _ in cuts])]

    def allocate(self, state: State) -> None:
        model, device = self.model, self.model.device
        real, vec3 = model.precision.scalar, model.precision.vec3
        self._check_box()
        self._choose_search()
        members = self._cut()
        self.members = model.array(members, wp.int32)
        # A hair less than half the skin, for the rounding of the distances compared.
        margins = [
            np.where(renewed, (0.4999 * self.skin) ** 2, np.inf)
            for renewed in (self.for_interactions, self.for_constraints)
        ]
        self.margins_squared = [model.array(each, real) for each in margins]
        self.order = wp.clone(self.members)
        self.slot = wp.zeros(self.count, dtype=wp.int32, device=device)
        self.x_listed = wp.zeros(self.count, dtype=vec3, device=device)
        self.cell_coordinate = wp.zeros(self.count, dtype=vec3, device=device)
        self.moved = wp.zeros(model.world_count, dtype=wp.int32, device=device)
        self.any_moved = wp.zeros(1, dtype=wp.int32, device=device)
        self.overflow = wp.zeros(1, dtype=wp.int32, device=device)
        self.pairs.count = wp.zeros(self.count, dtype=wp.int32, device=device)
        self.found = wp.zeros(self.count, dtype=wp.int32, device=device)
        super().allocate(state)
        self.planes = wp.zeros((3, self.count + rows.BLOCK), dtype=real, device=device)
        start = state["position"].numpy()[members].astype(np.float64)
        for k, block in enumerate(self.blocks):
            if self.large[block.world] and block.count:
                self.grids[k] = grid_over(model, block, start[block.begin : block.end])
        self._resize(np.full(len(self.blocks), 32))
        self.mark_all()
        self.update(state)
        self.grow()

    def _check_box(self) -> None:
        for w in range(self.model.world_count):
            for axis, on in enumerate(self.model.periodic):
                length = self.model.box_length[w, axis]
                if on and length < 2.0 * self.cutoff[w] * (1 - 1e-9):
                    raise validate.fail(
                        "Scene", f"periodic length along {'xyz'[axis]}",
                        f"be at least two cutoffs ({2 * self.cutoff[w]:g}) of {self.users[0]}",
                        float(length), "enlarge the box or shorten the cutoff",
                    )  # fmt: skip

    def _resize(self, room: np.ndarray) -> None:
        """Rows of so many neighbours, by block: contiguous if vectorised, interleaved for CUDA.

        Those of blocks by size are always contiguous, as they are of very different lengths.
        """
        model = self.model
        stride = -(-(room + rows.SPARE) // 16) * 16
        self.room = stride - rows.SPARE
        self.generation += 1
        counts = np.array([block.count for block in self.blocks])
        of_slot = np.repeat(np.arange(len(counts)), counts)
        contiguous = model.vectorised or len(counts) > model.world_count
        if contiguous:
            begin = np.concatenate([[0], np.cumsum(stride[of_slot])])
        else:
            self.room[:] = self.room.max()
            begin = np.append(np.arange(self.count), self.count * stride.max())
        self.index = wp.zeros(int(begin[-1]), dtype=wp.int32, device=model.device)
        self.pairs.index, self.pairs.row = self.index, model.array(begin[:-1], wp.int64)
        self.pairs.entry_stride = 1 if contiguous else max(1, self.count)
        self.struct.room = model.array(self.room, wp.int32)

    @property
    def work(self) -> float:
        """Pairs that are listed at present."""
        return float(self.pairs.count.numpy().sum())

    @property
    def capacity(self) -> int:
        """Neighbours that the longest rows have room for."""
        return int(self.room.max())

    def mark_all(self) -> None:
        """Have the next update rebuild every world."""
        self.moved.fill_(1)
        self.any_moved.fill_(1)

    def mark(self, worlds: list[int]) -> None:
        """Have the next update rebuild these worlds."""
        for w in worlds:
            self.moved[w : w + 1].fill_(1)
        self.any_moved.fill_(1)

    def update(self, state: State, *, for_constraint: bool = False) -> None:
        """Rebuild the rows of worlds in which something moved, and the slot-ordered copies."""
        model, device = self.model, self.model.device
        flag = kernels.moved_kernel(model.precision, model.periodic)
        launch(
            flag,
            self.count,
            [self.members, self.world, model.box, self.margins_squared[for_constraint],
             state.position, self.x_listed, self.moved, self.any_moved],
            device,
        )  # fmt: skip
        with when(self.any_moved):
            self._take(state)
        self.gather(state, self.names)

    def renew(self, state: State, worlds: list[int]) -> None:
        """Make the rows of these worlds from the present positions, now and outside a frame."""
        self.mark(worlds)
        self._take(state)
        self.grow()

    def _take(self, state: State) -> None:
        """Rows of the worlds marked as moved, from the present positions."""
        launch(
            kernels.build_kernels(self.model.precision).take_positions,
            self.count,
            [self.members, self.world, self.moved, state.position, self.x_listed],
            self.model.device,
        )
        self.rebuild()

    def rebuild(self) -> None:
        """Make the rows of the worlds marked as moved from ``x_listed``, and unmark them."""
        for w in sorted({self.blocks[k].world for k in self.grids}):
            with when(self.moved[w : w + 1]):
                self._rebuild_grids(w)
        if self.has_direct:
            self._rebuild_direct()
        call(self.moved.zero_)
        call(self.any_moved.zero_)

    def _rebuild_grids(self, w: int) -> None:
        model, device = self.model, self.model.device
        mine = [(self.blocks[k], *grid) for k, grid in self.grids.items()]
        mine = [each for each in mine if each[0].world == w]
        to_cells = kernels.cell_coordinates_kernel(model.precision)
        sort = kernels.build_kernels(model.precision).sort_slots
        for block, grid, place in mine:
            u = self.cell_coordinate[block.begin : block.end]
            launch(to_cells, block.count, [place, self.x_listed, self.cell_coordinate], device)
            call(functools.partial(grid.build, u, 1.0))
            launch(
                sort,
                block.count,
                [grid.id, place, self.members, self.x_listed, self.order, self.slot, self.planes],
                device,
            )
        make = rows.grid_rows_kernel(model.precision, model.periodic, model.vectorised)
        for block, _, _ in mine:
            for k, (other, grid, place) in enumerate(mine):
                reach = block.reach[k]
                launch(
                    make,
                    block.count,
                    [grid.id, place, block.begin, reach / other.own, int(k > 0),
                     model.box, reach**2, self.struct, self.slot, self.planes, self.pairs,
                     self.found, self.overflow],
                    device,
                )  # fmt: skip

    def _rebuild_direct(self) -> None:
        model = self.model
        spread = kernels.build_kernels(model.precision).spread
        launch(spread, self.count, [self.x_listed, self.planes], model.device)
        make = rows.direct_rows_kernel(model.precision, model.periodic, model.vectorised)
        launch(
            make,
            self.count,
            [self.direct, model.box, self.moved, self.struct, self.planes, self.pairs, self.found,
             self.overflow],
            model.device,
        )  # fmt: skip

    def lengthen(self) -> bool:
        """If a row was full: make room for as many as were found. The rows are then empty."""
        if not self.overflow.numpy()[0]:
            return False
        found = self.found.numpy()
        longest = [found[each.begin : each.end].max(initial=0) for each in self.blocks]
        full = np.array(longest) > self.room
        # The rows that were full may have been those of an earlier substep: always longer than now.
        full |= not full.any()
        longer = 1.25 * np.maximum(longest, self.room) + 8
        self._resize(np.where(full, longer.astype(int), self.room))
        self.overflow.zero_()
        return True

    def grow(self) -> bool:
        """If a row was full: make all rows longer, and again from the same positions."""
        grown = self.lengthen()
        if grown:
            self.mark_all()
            self.rebuild()
        return grown

    def halves(self) -> np.ndarray:
        """Up to which half of a cutoff each particle is looked for by size, (n,); else inf."""
        found = np.full(self.model.particle_count, np.inf)
        members = self.members.numpy()
        for block in self.blocks:
            if self.half[block.world] is not None:
                found[members[block.begin : block.end]] = block.largest
        return found

    def describe(self) -> str:
        grids = ["{} x {} x {}".format(*grid_shape(grid)) for grid, _ in self.grids.values()]
        how = f"hash grid {grids[0]}" if grids else "direct search"
        how += f" and {len(grids) - 1} more" if len(grids) > 1 else ""
        mean = self.pairs.count.numpy().sum() / max(1, self.count)
        looking = [block for block in self.blocks if self.cutoff[block.world] > 0]
        least = min((block.reach.min() for block in looking), default=0.0)
        most = max((block.reach.max() for block in looking), default=0.0)
        reach = f"{most:g}" if least == most else f"{least:g} to {most:g}"
        return (
            f"within {reach} of {self.count} particles, {mean:.0f} neighbours on "
            f"average, room for {self.capacity}, {how}, for {', '.join(self.users)}"
        )

    @property
    def memory(self) -> int:
        own = [self.x_listed, self.cell_coordinate, self.slot, self.index, self.pairs.count,
               self.pairs.row, self.found]  # fmt: skip
        return super().memory + sum(a.capacity for a in own)

    def neighbors_of(self, particle: int) -> np.ndarray:
        """Particles in the row of ``particle``: all within the cutoff, and some in the skin."""
        order = self.order.numpy()
        slot = int(np.nonzero(order == particle)[0][0])
        entries = np.arange(self.pairs.count.numpy()[slot])
        at = self.pairs.row.numpy()[slot] + entries * self.pairs.entry_stride
        return order[self.index.numpy()[at]]
