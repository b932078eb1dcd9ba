"""Verlet lists: rows of neighbours that last until particles have moved.

A list holds for every cluster of slots the slots nearer than cutoff + skin, and stays valid until a
particle has moved half the skin; then the lists of that particle's world are rebuilt, and of no
other, so that a world in a batch goes exactly as it goes alone. How thick a skin pays is chosen
in :mod:`.skin`. Worlds are kept apart by construction: a large world has hash grids of its own, one
for each of its blocks.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...kernels.engine.loops import ROWS
from ...kernels.engine.neighbors import renewal as kernels
from ...kernels.engine.neighbors.boxes import boxes_kernel, margin_kernel
from ...kernels.engine.neighbors.clusters import SMALL
from ...kernels.engine.neighbors.skin import reach_kernel
from ..execution.launch import call, launch, when
from ..model import Model
from ..state import State
from .all_pairs import AllPairs
from .blocks import blocks, blocks_struct
from .clusters import ClusterRows
from .hash_rows import HashRows
from .listed import neighbors_of
from .own_reach import OwnReach
from .skin import Skin

DIRECT = 8192  # largest world that CUDA looks through directly; measured


FEW = 32  # partners that there is room for before any have been looked for


class VerletList(AllPairs):
    """Neighbour rows within cutoff + skin, per world."""

    partners = ROWS

    def __init__(self, model: Model, members: np.ndarray):
        super().__init__(model, members)
        self.sorted = True
        self.cutoff = np.zeros(model.world_count)  # 0: nothing is looked for in that world
        # By world: of particles that differ much in size, half the cutoff of each; else None.
        self.half: list[np.ndarray | None] = [None] * model.world_count
        self.own: OwnReach | None = None
        self.generation = 0

    def _cut(self) -> np.ndarray:
        """Cut the worlds into blocks; returns the members in the order of their slots."""
        ranges = (self.begin_host, self.end_host)
        cuts = list(blocks(*ranges, self.cutoff, self.half))
        self.blocks = [block for _, of_world, _ in cuts for block in of_world]
        unit = np.array([most for *_, most in cuts])
        if self.own is not None:
            unit = self.own.typical(self.members_host, self.model)
            self.blocks = [replace(each, own=float(unit[each.world])) for each in self.blocks]
        self.skin = Skin(self.model, unit, ~self.for_interactions)
        self.struct = blocks_struct(self.model, [of_world for _, of_world, _ in cuts])
        return self.members_host[np.concatenate([order for order, _, _ in cuts])]

    def allocate(self, state: State) -> None:
        model, device = self.model, self.model.device
        real, vec3 = model.precision.scalar, model.precision.vec3
        self._check_box()
        members = self._cut()
        self.members = model.array(members, wp.int32)
        if self.own is not None:
            self.own.allocate(self, state)
        # By phase and world, once there are rows; in a phase that does not renew them never.
        renewed = np.array([self.for_interactions, self.for_constraints])
        self.margins_squared = model.array(np.where(renewed, 0.0, np.inf), real)
        if self.skin.chosen:
            state.require({"time"})
        self.order = wp.clone(self.members)
        self.x_listed = model.array(state["position"].numpy()[members], vec3)
        self.box = model.box  # that rows are made in
        if model.flexible:
            self.box = wp.clone(model.box)
            self.widest = model.array(self.cutoff, wp.float64)
        self.moved = wp.zeros(model.world_count, dtype=wp.int32, device=device)
        self.any_moved = wp.zeros(1, dtype=wp.int32, device=device)
        self.overflow = wp.zeros(1, dtype=wp.int32, device=device)
        Layout = ClusterRows if model.vectorised else HashRows
        self._set_clusters(Layout.clusters(model, self.blocks))
        self.pairs.count = wp.zeros(self.rows, dtype=wp.int32, device=device)
        self.found = wp.zeros(self.rows, dtype=wp.int32, device=device)
        super().allocate(state)
        sizes = (self.end_host - self.begin_host) * (self.cutoff > 0)
        self.layout = Layout(self, sizes > (SMALL if model.device.is_cpu else DIRECT))
        # By block: its clusters follow each other, as blocks do.
        self.edges = np.searchsorted(
            self.pairs.lead.numpy(), [*(block.begin for block in self.blocks), self.count]
        )
        self._make_room(np.full(self.rows, FEW))
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

    def _make_room(self, found: np.ndarray) -> None:
        """Rows for as many as were found, by cluster, and longer ones than there were."""
        entries = self.layout.make_room(found)
        self.index = wp.zeros(entries, dtype=wp.int32, device=self.model.device)
        self.pairs.index = self.index
        self.generation += 1

    @property
    def reach(self) -> np.ndarray:
        """Within what distance partners are listed, (worlds,); of pairs that reach farthest."""
        return np.where(self.cutoff > 0, self.cutoff + self.skin.thickness, np.inf)

    def persistent(self) -> dict[str, wp.array]:
        """What rows are made from, besides what never changes."""
        kept = {"box": self.model.numbers(self.box)} if self.model.flexible else {}
        if self.own is not None:
            kept["reach"] = self.own.reach
        return {"x": self.x_listed, **kept, **self.skin.persistent()}

    def worlds(self, name: str) -> np.ndarray:
        """The world of each row of one of these."""
        if name == "x":
            return self.model.world_of[self.members_host]
        if name == "reach":
            return self.model.world_of
        return np.arange(self.model.world_count)

    @property
    def work(self) -> float:
        """Pairs that are listed at present."""
        return float(self.pairs.count.numpy() @ self.of_cluster)

    @property
    def grids(self) -> dict[int, Any]:
        """Hash grids, by block; small worlds have none."""
        return self.layout.grids

    @property
    def capacity(self) -> int:
        """Entries of a row that there is room for."""
        return self.layout.capacity

    def mark_all(self) -> None:
        """Have the next update rebuild every world."""
        self.moved.fill_(1)
        self.any_moved.fill_(1)

    def mark(self, worlds: list[int]) -> None:
        """Have the next update rebuild these worlds."""
        for w in worlds:
            self.moved[w : w + 1].fill_(1)
        self.any_moved.fill_(1)

    def update(
        self, state: State, *, for_constraint: bool = False, among: wp.array | None = None
    ) -> None:
        """Rebuild the rows of worlds in which something moved, and the slot-ordered copies."""
        model, device = self.model, self.model.device
        block = kernels.BLOCK if model.vectorised else 1
        flag = kernels.moved_kernel(model.precision, model.periodic, model.flexible, block)
        if model.flexible:
            inputs = [model.box, self.box, self.widest, self.skin.struct, self.margins_squared]
            launch(margin_kernel(model.precision), model.world_count, inputs, device)
        launch(
            flag,
            self.count,
            [self.members, self.world, model.box, self.box,
             self.margins_squared[int(for_constraint)], state.position, self.x_listed,
             self.moved, self.any_moved],
            device,
            block,
        )  # fmt: skip
        self.skin.flag(state, self.moved, self.any_moved)
        if among is not None:
            launch(kernels.among_kernel(), model.world_count, [among, self.moved], device)
        with when(self.any_moved):
            self._take(state)
        self.gather(state, self.names)

    def renew(self, state: State, worlds: list[int]) -> None:
        """Make the rows of these worlds from the present positions, now and outside a frame."""
        self.skin.begin_anew(worlds)
        self.mark(worlds)
        self._take(state)
        self.grow()

    def _take(self, state: State) -> None:
        """Rows of the worlds marked as moved, from the present positions."""
        model, farthest = self.model, self.skin.struct.farthest_squared
        launch(
            kernels.positions_kernel(model.precision, model.periodic, model.flexible),
            self.count,
            [self.members, self.world, model.box, self.box, self.moved, state.position,
             self.x_listed, farthest],
            model.device,
        )  # fmt: skip
        if model.flexible:
            inputs = [self.moved, model.box, self.box]
            launch(boxes_kernel(model.precision), model.world_count, inputs, model.device)
        if self.own is not None:
            self.own.take()
        self.skin.choose(state, self.moved)
        self.rebuild()

    def rebuild(self) -> None:
        """Make the rows of the worlds marked as moved from ``x_listed``, and unmark them."""
        if self.own is not None:
            self.own.set_cutoffs()
        inputs = [self.moved, self.skin.struct, self.struct, self.margins_squared]
        reach = reach_kernel(self.model.precision)
        launch(reach, self.model.world_count, inputs, self.model.device)
        self.layout.rebuild()
        self.sort_held()
        call(self.moved.zero_)
        call(self.any_moved.zero_)

    def lengthen(self) -> bool:
        """If a row was full: make room for as many as were found. The rows are then empty."""
        if not self.overflow.numpy()[0]:
            return False
        self._make_room(self.found.numpy())
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
        mean = self.work / max(1, self.count)
        thick = self.skin.thickness
        looking = [block for block in self.blocks if self.cutoff[block.world] > 0]
        least = min((each.cutoff.min() + thick[each.world] for each in looking), default=0.0)
        most = max((each.cutoff.max() + thick[each.world] for each in looking), default=0.0)
        reach = f"{most:g}" if least == most else f"{least:g} to {most:g}"
        if self.own is not None:
            reach = f"{self.own.factor:g} times the {self.own.size.replace('_', ' ')}"
        return (
            f"within {reach} of {self.count} particles, {mean:.0f} listed on average, room for "
            f"{self.capacity}, {self.layout.describe()}, for {', '.join(self.users)}"
        )

    @property
    def memory(self) -> int:
        own = [self.x_listed, self.index, self.pairs.count, self.pairs.row, self.found,
               self.pairs.lead, self.pairs.cluster, *self.layout.arrays,
               *([] if self.own is None else [self.own.reach])]  # fmt: skip
        return super().memory + sum(a.capacity for a in own)

    def neighbors_of(self, particle: int) -> np.ndarray:
        """Particles listed for ``particle``: all within the cutoff, and some in the skin."""
        return neighbors_of(self, particle)
