"""Every particle of the own world: the plainest answer to who looks at whom."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ...kernels.engine.loops import ALL, Pairs
from ...kernels.engine.neighbors import renewal as kernels
from ...kernels.engine.packed import CROWD
from ..execution.launch import launch
from ..model import Model
from ..state import State


class AllPairs:
    """Every particle of the own world among the members, without a list."""

    partners = ALL

    def __init__(self, model: Model, members: np.ndarray):
        self.model, self.count = model, len(members)
        self.members_host = members
        worlds = model.world_of[members]
        edges = np.arange(model.world_count)
        self.begin_host = np.searchsorted(worlds, edges, side="left")
        self.end_host = np.searchsorted(worlds, edges, side="right")
        self.members = model.array(members, wp.int32)
        self.world = model.array(worlds, wp.int32)
        # A loop over all particles in their own order reads the state's arrays themselves.
        self.sorted = len(members) != model.particle_count
        self.order = self.members
        self.names: set[str] = {"position"}
        self.fields: dict[str, wp.array] = {}
        self.held: list[tuple[wp.array, wp.array]] = []  # that never change, and by slot
        self.pairs = Pairs()
        self.pairs.world = self.world
        self.pairs.begin = model.array(self.begin_host, wp.int32)
        self.pairs.end = model.array(self.end_host, wp.int32)
        self.slots = model.array(np.arange(self.count), wp.int32)
        self.rows = 0  # clusters of a pass over it
        self.block = 1  # at most so many slots in each
        self.users: list[str] = []
        # By world: whether it renews the list before interactions, and before constraints.
        self.for_interactions, self.for_constraints = np.zeros((2, model.world_count), dtype=bool)
        self.leader = np.zeros(model.world_count, dtype=int)  # see Neighbors

    def _set_clusters(self, lead: np.ndarray) -> None:
        """Clusters of slots that begin here; at the end the first slot of one more."""
        model, sizes = self.model, np.diff(lead)
        self.rows, self.of_cluster, self.block = len(sizes), sizes, int(sizes.max(initial=1))
        self.pairs.lead = model.array(lead, wp.int32)
        self.pairs.cluster = model.array(np.repeat(np.arange(len(sizes)), sizes), wp.int32)

    @property
    def work(self) -> float:
        """Pairs that a pass over it looks at."""
        return float(((self.end_host - self.begin_host).astype(float) ** 2).sum())

    def request(self, names: set[str]) -> None:
        """Have these per-particle arrays ready in slot order at every update."""
        self.names |= names

    def hold(self, array: wp.array) -> wp.array:
        """An array in slot order, of one by particle that never changes."""
        self.held.append((array, self.array(array.dtype)))
        return self.held[-1][1]

    def allocate(self, state: State) -> None:
        """Make the arrays, once all requests are in."""
        if self.partners == ALL:
            size = CROWD if self.model.vectorised else 1
            worlds = zip(self.begin_host, self.end_host, strict=True)
            leads = [np.arange(begin, end, size) for begin, end in worlds]
            self._set_clusters(np.append(np.concatenate(leads), self.count))
        self.pairs.order = self.order
        for name in sorted(self.names):
            source = state[name]
            if self.sorted:
                self.fields[name] = self.array(source.dtype)
            else:
                self.fields[name] = source
        self.sort_held()

    def update(
        self, state: State, *, for_constraint: bool = False, among: wp.array | None = None
    ) -> None:
        """Bring the slot-ordered copies up to date."""
        self.gather(state, self.names)

    def gather(self, state: State, names: set[str]) -> None:
        """Copy these arrays into slot order; nothing to do where that is their own order."""
        if self.sorted:
            for name in sorted(names):
                self.sort(state[name], self.fields[name])

    def sort_held(self) -> None:
        """Bring what never changes into the order of the slots."""
        for source, target in self.held:
            self.sort(source, target)

    def sort(self, source: wp.array, target: wp.array) -> None:
        """Copy an array by particle into slot order."""
        gather = kernels.gather_kernel(target.dtype)
        launch(gather, self.count, [self.order, source, target], self.model.device)

    def sum(self, kernel: wp.Kernel, inputs: Sequence[Any]) -> None:
        """Launch a sum over the partners of every slot, by clusters."""
        launch(kernel, self.rows * self.block, inputs, self.model.device, self.block)

    def array(self, dtype: Any) -> wp.array:
        """A new array over the slots, and one entry behind them that may be read."""
        return wp.zeros(self.count + 1, dtype=dtype, device=self.model.device)[: self.count]

    def describe(self) -> str:
        """One line for reports."""
        return f"all pairs of {self.count} particles, for {', '.join(self.users)}"

    @property
    def memory(self) -> int:
        """Bytes of the arrays that are the list's own."""
        own = [self.members, self.world, *(self.fields.values() if self.sorted else ())]
        return sum(a.capacity for a in own)
