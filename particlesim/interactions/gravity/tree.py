"""Sums over a tree of bodies, made anew from their places each time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import warp as wp

from ...engine.execution.launch import launch
from ...engine.model import Model, filled
from ...engine.state import State
from ...kernels.interactions.tree import nodes
from ...kernels.interactions.tree.moments import moment_kernels
from ...kernels.interactions.tree.walk import walk_kernel
from ..pair_loop import squared_distances
from .orders import NativeOrder, SortedOrder


class Tree:
    """Gravity of bodies by a tree for each world, of which none depends on another.

    A binary tree, halved at the median body down to a few. Which slots a node has follows from the
    number of bodies; which body stands where, and the moments of the nodes, follow from the places
    now. So a world is summed alike in a batch and alone, and after a restart.

    Args:
        model: The worlds.
        owner: Whose sums, for errors.
        members: Rows of the bodies, world by world.
        columns: ``constant`` and, where the bodies have no softening of their own, ``softening``,
            (worlds,) each.

    Raises:
        ValueError: Distances whose squares leave the kernels' precision.
    """

    def __init__(
        self, model: Model, owner: str, members: np.ndarray, columns: Mapping[str, np.ndarray]
    ):
        self.model, self.owner = model, owner
        self.members, self.count = members, len(members)
        self.own = "softening" not in columns
        precision, angle = model.precision, model.settings.opening_angle or 0.0
        closest = squared_distances(owner, model, None)["closest_squared"]
        softening = np.zeros(model.world_count) if self.own else columns["softening"]
        model.squares_fit(owner, "softening", softening)
        self.params = model.structures(
            nodes.gravity_type(precision),
            {
                "constant": columns["constant"], "softening_squared": softening**2,
                "closest_squared": closest,
                "opening_squared": np.full(model.world_count, angle**2),
            },
        )  # fmt: skip
        self.levels, self.data = self._nodes()
        self.kernels = moment_kernels(precision)
        make = NativeOrder if model.vectorised else SortedOrder
        self.order = make(model, members, self.levels, self.data) if self.count else None

    def _nodes(self) -> tuple[list[tuple[int, int]], Any]:
        """First entry of ``by_level`` and how many, for each level; and what is known of nodes."""
        model = self.model
        begin, end, world, level = _halves(model, self.members)
        # The nodes of a world that none below the same slots is before: its root; and likewise the
        # largest that are small enough for a group.
        small = np.nonzero(end - begin <= nodes.GROUP)[0]
        group, top = small[_first(begin[small], end[small])], np.nonzero(_first(begin, end))[0]
        root = np.full(model.world_count, -1)
        root[world[top]] = top
        after = np.searchsorted(begin, end)
        after[end == end[root[world]]] = -1
        precision, device = model.precision, model.device
        data = nodes.tree_type(precision)()
        known = {
            "begin": begin, "end": end, "next": after, "world": world, "root": root,
            "by_level": np.argsort(level, kind="stable"), "group": group,
            "group_of": np.repeat(np.arange(len(group)), (end - begin)[group]),
        }  # fmt: skip
        for name, values in known.items():
            setattr(data, name, model.array(values, wp.int32))
        data.order = wp.zeros(self.count, dtype=wp.int32, device=device)
        shape = (nodes.PLANES, self.count + nodes.PADDING)
        data.x = wp.zeros(shape, dtype=precision.scalar, device=device)
        data.cell = wp.zeros(len(begin), dtype=precision.vector(nodes.CELL), device=device)
        data.box = wp.zeros(len(begin), dtype=precision.vector(6), device=device)
        self.group_count, self.worlds = len(group), world
        counts = np.bincount(level)
        return list(zip(np.cumsum(counts) - counts, counts, strict=True)), data

    def attach(self, model: Model, state: State) -> None:
        """Nothing to keep: the bodies are ordered anew each time."""

    def complaint(self) -> str:
        """That places are too coarse for how far the bodies are apart."""
        lengths = self.model.apart()[1][self.model.world_of[self.members]]
        return self.model.unresolved(self.owner, "spacing", lengths, self.members)

    def build(self, state: State) -> None:
        """Order the bodies as they are placed now, and sum up the moments of all nodes."""
        if self.order is None:
            return
        self.order.place(state)
        device, made = self.model.device, self.kernels
        softening = state["softening"] if self.own else state.mass
        of_bodies = [self.order.by, state.position, state.mass, softening]
        inputs = [self.data, int(self.own), *of_bodies]
        launch(made.fill, self.count, inputs, device)
        for start, count in reversed(self.levels):
            launch(made.sum_up, count, [start, self.data], device)

    def pull(self, state: State) -> None:
        """Add the forces."""
        self.build(state)
        self._walk(nodes.FORCE, {"f": state.force})

    def measure(self, state: State, energy: wp.array, virial: wp.array) -> None:
        """Add each body's half of its energies with others, and of its virials."""
        self.build(state)
        self._walk(nodes.MEASURE, {"energy": energy, "virial": virial})

    def _walk(self, what: str, out: Mapping[str, wp.array]) -> None:
        model = self.model
        kernel = walk_kernel(model.precision, what, self.own, model.vectorised)
        o = filled(nodes.out_type(model.precision, what), out)
        inputs = [self.data, self.params, o]
        if model.vectorised:
            launch(kernel, self.group_count * nodes.GROUP, inputs, model.device, nodes.GROUP)
        else:
            launch(kernel, self.count, inputs, model.device)

    def nodes(self, world: int) -> tuple[np.ndarray, np.ndarray]:
        """Of each node of a world, as last built, its mass, and the squares of its softening and of
        the radius of a homogeneous ball that has its second moments, R^2 = 5/3 <y^2>, summed.
        """
        cell = self.data.cell.numpy()[self.worlds == world].astype(np.float64)
        s2 = self.params.numpy()["softening_squared"][world] + 2.0 * cell[:, nodes.SOFTENING]
        R2 = 5.0 / 3.0 * cell[:, nodes.SECOND : nodes.SECOND + 3].sum(axis=1)
        return cell[:, nodes.MASS], R2 + s2

    def couples(self, world: int) -> tuple[np.ndarray, np.ndarray]:
        """Of every two bodies in a leaf, as last built, their mass, and the square of their
        distance, softened.
        """
        begin, end = self.data.begin.numpy(), self.data.end.numpy()
        leaf = np.nonzero((self.worlds == world) & (end - begin <= nodes.LEAF))[0]
        i, j = np.triu_indices(nodes.LEAF, 1)
        first, second = begin[leaf, None] + i, begin[leaf, None] + j
        there = second < end[leaf, None]
        x = self.data.x.numpy().astype(np.float64)
        a, b = x[:, first[there]], x[:, second[there]]
        r2 = ((a[:3] - b[:3]) ** 2).sum(axis=0)
        s2 = a[4] + b[4] + self.params.numpy()["softening_squared"][world]
        return a[3] + b[3], np.where(r2 > 0, r2 + s2, np.inf)


def _halves(model: Model, members: np.ndarray) -> tuple[np.ndarray, ...]:
    """The nodes of all worlds, each before those below it: ``begin, end, world, level``."""
    edges = np.searchsorted(model.world_of[members], np.arange(model.world_count + 1))
    world = np.nonzero(np.diff(edges))[0]
    begin, end, level = edges[world], edges[world + 1], np.zeros(len(world), int)
    found = [(begin, end, world, level)]
    while len(begin):
        halved = end - begin > nodes.LEAF
        a, b = begin[halved], end[halved]
        middle = a + (b - a) // 2  # wherever the world begins
        begin, end = np.append(a, middle), np.append(middle, b)
        world, level = np.tile(world[halved], 2), np.tile(level[halved] + 1, 2)
        found.append((begin, end, world, level))
    columns = [np.concatenate(each) for each in zip(*found, strict=True)]
    order = np.lexsort((columns[3], columns[0]))
    return tuple(each[order] for each in columns)


def _first(begin: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Whether none of those before has the same slots."""
    before = np.append(0, np.maximum.accumulate(end)[:-1])[: len(end)]
    return begin >= before
