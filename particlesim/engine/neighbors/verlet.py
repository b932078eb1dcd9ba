"""Verlet lists, built from ``wp.HashGrid`` or by looking at a whole world.

A list holds for every slot the slots nearer than cutoff + skin, and stays valid until a particle
has moved half the skin; then the lists of that particle's world are rebuilt, and of no other, so
that a world in a batch goes exactly as it goes alone. Worlds are kept apart by construction: a
large world has a hash grid of its own, a small one is looked through directly.
"""

from __future__ import annotations

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

# Skin over cutoff, where Settings leaves it open; measured. Grains have few partners, so that rows
# cost little to hold and much to make.
SKIN, SKIN_OF_CONTACTS = 0.12, 0.2
DIRECT_CPU, DIRECT_CUDA = 512, 8192  # largest world that is looked through directly; measured
CELLS_PER_PARTICLE = 4  # bounds the cost of clearing a grid
MAX_CELLS = 256  # along an axis


class VerletList(AllPairs):
    """Neighbour rows within cutoff + skin, per world."""

    partners = ROWS

    def __init__(self, model: Model, members: np.ndarray):
        super().__init__(model, members)
        self.cutoff = np.zeros(model.world_count)  # 0: nothing is looked for in that world
        self.capacity = self.generation = 0
        self.grids: dict[int, tuple[wp.HashGrid, Any]] = {}

    def _choose_search(self) -> None:
        """Which worlds have a grid, and which are looked through directly."""
        sizes = (self.end_host - self.begin_host) * (self.cutoff > 0)
        limit = DIRECT_CPU if self.model.device.is_cpu else DIRECT_CUDA
        self.grid_worlds = [int(w) for w in np.nonzero(sizes > limit)[0]]
        small = (sizes > 0) & (sizes <= limit)
        self.has_direct = bool(small.any())
        self.direct = self.model.array(small, wp.int32)
        self.sorted = self.sorted or bool(self.grid_worlds)

    def allocate(self, state: State) -> None:
        model, device = self.model, self.model.device
        real, vec3 = model.precision.scalar, model.precision.vec3
        self._check_box()
        self._choose_search()
        given = model.settings.skin
        share = np.where(self.for_interactions, SKIN, SKIN_OF_CONTACTS)
        skin = self.cutoff * share if given is None else np.full_like(self.cutoff, given)
        self.reach = np.where(self.cutoff > 0, self.cutoff + skin, np.inf)
        # A hair less than half the skin, for the rounding of the distances compared.
        margins = [
            np.where(renewed, (0.4999 * skin) ** 2, np.inf)
            for renewed in (self.for_interactions, self.for_constraints)
        ]
        self.margins_squared = [model.array(each, real) for each in margins]
        self.reach_squared = model.array(self.reach**2, real)
        self.order = wp.clone(self.members)
        self.slot = wp.zeros(self.count, dtype=wp.int32, device=device)
        self.x_listed = wp.zeros(self.count, dtype=vec3, device=device)
        self.cell_coordinate = wp.zeros(self.count, dtype=vec3, device=device)
        self.moved = wp.zeros(model.world_count, dtype=wp.int32, device=device)
        self.any_moved = wp.zeros(1, dtype=wp.int32, device=device)
        self.overflow = wp.zeros(1, dtype=wp.int32, device=device)
        self.pairs.count = wp.zeros(self.count, dtype=wp.int32, device=device)
        super().allocate(state)
        self.planes = wp.zeros((3, self.count + rows.BLOCK), dtype=real, device=device)
        start = state["position"].numpy()[self.members_host].astype(np.float64)
        for w in self.grid_worlds:
            self.grids[w] = self.grid_over(w, start[self.begin_host[w] : self.end_host[w]])
        self._resize(32)
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

    def grid_over(self, w: int, x: np.ndarray) -> tuple[wp.HashGrid, Any]:
        """A hash grid sized to world w, and its cell coordinates."""
        model, reach = self.model, max(float(self.reach[w]), 1e-30)
        lower, upper = x.min(axis=0), x.max(axis=0)
        # A little more than the reach, for the rounding of cell coordinates in float32.
        cells = np.clip(np.floor((upper - lower) / (1.001 * reach)) + 1, 1, MAX_CELLS)
        scale = np.full(3, 1.0 / (1.001 * reach))
        for axis, on in enumerate(model.periodic):
            if on:
                length = model.box_length[w, axis]
                cells[axis] = np.clip(np.floor(length / (1.001 * reach)), 1, MAX_CELLS)
                lower[axis] = model.box_lower[w, axis]
                upper[axis] = lower[axis] + length
        budget = max(4096, CELLS_PER_PARTICLE * len(x))
        while np.prod(cells) > budget:
            cells[np.argmax(cells)] = np.ceil(cells.max() / 2)
        for axis, on in enumerate(model.periodic):
            if on:
                scale[axis] = cells[axis] / model.box_length[w, axis]
        axes, backward = _slowest_last(x)
        turn = np.zeros((3, 3))
        turn[range(3), axes] = np.where(backward, -scale, scale)[axes]
        dimensions = (int(c) for c in cells[axes])
        grid = wp.HashGrid(*dimensions, device=model.device, dtype=self._real)
        grid.reserve(len(x))
        place = kernels.cells_type(model.precision)()
        place.origin = model.precision.vec3(*np.where(backward, upper, lower))
        place.turn = model.precision.mat33(turn)
        place.first, place.world = int(self.begin_host[w]), w
        return grid, place

    @property
    def _real(self) -> Any:
        return self.model.precision.scalar

    def _resize(self, capacity: int) -> None:
        """Rows for ``capacity`` neighbours; contiguous if vectorised, else interleaved for CUDA."""
        stride = -(-(capacity + rows.SPARE) // 16) * 16
        self.capacity = stride - rows.SPARE
        self.generation += 1
        self.index = wp.zeros(self.count * stride, dtype=wp.int32, device=self.model.device)
        pairs = self.pairs
        pairs.index, pairs.capacity = self.index, self.capacity
        contiguous = self.model.vectorised
        pairs.row_stride = stride if contiguous else 1
        pairs.entry_stride = 1 if contiguous else max(1, self.count)

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
        for w in self.grids:
            with when(self.moved[w : w + 1]):
                self._rebuild_grid(w)
        if self.has_direct:
            self._rebuild_direct()
        call(self.moved.zero_)
        call(self.any_moved.zero_)

    def _rebuild_grid(self, w: int) -> None:
        model, device = self.model, self.model.device
        grid, place = self.grids[w]
        begin, count = int(self.begin_host[w]), int(self.end_host[w] - self.begin_host[w])
        u = self.cell_coordinate[begin : begin + count]
        to_cells = kernels.cell_coordinates_kernel(model.precision)
        launch(to_cells, count, [place, self.x_listed, self.cell_coordinate], device)
        call(lambda: grid.build(u, 1.0))
        launch(
            kernels.build_kernels(model.precision).sort_slots,
            count,
            [grid.id, place, self.members, self.x_listed, self.order, self.slot,
             self.planes],
            device,
        )  # fmt: skip
        make = rows.grid_rows_kernel(model.precision, model.periodic, model.vectorised)
        launch(
            make,
            count,
            [grid.id, place, model.box, self.reach_squared, self.slot, self.planes,
             self.pairs, self.overflow],
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
            [self.direct, model.box, self.reach_squared, self.moved, self.planes, self.pairs,
             self.overflow],
            model.device,
        )  # fmt: skip

    def lengthen(self) -> bool:
        """If a row was full: make room for as many as were found. The rows are then empty."""
        if not self.overflow.numpy()[0]:
            return False
        # The rows that were full may have been those of an earlier substep: always longer than now.
        longest = max(int(self.pairs.count.numpy().max()), self.capacity)
        self._resize(int(1.25 * longest) + 8)
        self.overflow.zero_()
        return True

    def grow(self) -> bool:
        """If a row was full: make all rows longer, and again from the same positions."""
        grown = self.lengthen()
        if grown:
            self.mark_all()
            self.rebuild()
        return grown

    def describe(self) -> str:
        grids = ["{} x {} x {}".format(*grid_shape(grid)) for grid, _ in self.grids.values()]
        how = f"hash grid {grids[0]}" if grids else "direct search"
        how += f" and {len(grids) - 1} more" if len(grids) > 1 else ""
        mean = np.minimum(self.pairs.count.numpy(), self.capacity).sum() / max(1, self.count)
        reach = self.reach[self.cutoff > 0].max(initial=0.0)
        return (
            f"within {reach:g} of {self.count} particles, {mean:.0f} neighbours on "
            f"average, room for {self.capacity}, {how}, for {', '.join(self.users)}"
        )

    @property
    def memory(self) -> int:
        own = [self.x_listed, self.cell_coordinate, self.slot, self.index, self.pairs.count]
        return super().memory + sum(a.capacity for a in own)

    def neighbors_of(self, particle: int) -> np.ndarray:
        """Particles in the row of ``particle``: all within the cutoff, and some in the skin."""
        order = self.order.numpy()
        slot = int(np.nonzero(order == particle)[0][0])
        count = min(int(self.pairs.count.numpy()[slot]), self.capacity)
        at = slot * self.pairs.row_stride + np.arange(count) * self.pairs.entry_stride
        return order[self.index.numpy()[at]]


def _slowest_last(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Axes by how far particles in their own order advance along them, and which go backward.

    A grid numbers its cells by the last axis first. Where that is the order of the particles too,
    what a thread writes by particle it reads by slot: two threads ran SPH 2.05 instead of 1.7 times
    as fast as one.
    """
    index = np.arange(len(x)) - 0.5 * (len(x) - 1)
    spread = np.maximum(x.std(axis=0), np.finfo(float).tiny)
    trend = index @ (x - x.mean(axis=0)) / spread
    return np.argsort(np.abs(trend), kind="stable"), trend < 0
