"""Clusters of all worlds as the kernels take them: merged, sorted by colour and cut in chunks."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine import topology
from ...engine.model import Model
from ...kernels.constraints.clusters.members import Moments, clusters_type

CHUNK = 256  # members that one thread adds up
# Of a cluster's other members, what a pinned one weighs. By one over that of a substep's way goals
# are off it; the angular momentum about it is exact, whatever it weighs.
PINNED = 1e4


def checked(owner: str, value: Any, argument: str = "clusters") -> list[np.ndarray]:
    """``value`` as clusters: (k,) different indices each, of at least two particles."""
    try:
        if isinstance(value, str | Mapping):
            raise TypeError
        rows = [np.asarray(getattr(each, "indices", each)) for each in value]
    except (TypeError, ValueError):
        rows = [np.zeros(())]
    found = []
    for n, row in enumerate(rows):
        if row.ndim != 1 or (len(row) and not np.issubdtype(row.dtype, np.integer)):
            raise validate.fail(
                owner, argument, "hold lists of particle indices", value,
                "give one list for each cluster",
            )  # fmt: skip
        if len(row) < 2:
            raise validate.fail(
                owner, f"{argument}[{n}]", "hold at least 2 particles", row, "leave it out"
            )
        if row.min() < 0:
            raise validate.fail(
                owner, f"{argument}[{n}]", "hold indices from 0 up", int(row.min()), "count from 0"
            )
        once, count = np.unique(row, return_counts=True)
        if len(once) < len(row):
            raise validate.fail(
                owner, f"{argument}[{n}]", "name different particles", int(once[count > 1][0]),
                "leave out what is there twice",
            )  # fmt: skip
        found.append(row.astype(np.int64))
    return found


class Members:
    """Clusters of all worlds.

    Row k of the arrays is cluster ``order[k]`` in the order in which the worlds list theirs. Those
    of one colour follow each other and share no particle: ``spans`` holds the first cluster and
    the one after the last, and the first chunk and the one after the last.
    """

    def __init__(
        self, owner: str, model: Model, clusters: Sequence[list[np.ndarray]],
        shapes: Sequence[list[np.ndarray] | None], color: np.ndarray,
    ):  # fmt: skip
        self.model = model
        each = [row for rows in clusters for row in rows]
        lengths = [len(rows) for rows in clusters]
        self.count = len(each)
        self.edges = np.concatenate([[0], np.cumsum(lengths)]).astype(int)
        self.order = np.argsort(color, kind="stable")
        self.world = np.repeat(np.arange(len(clusters)), lengths)[self.order]
        rest = [
            shape
            for w, (rows, given) in enumerate(zip(clusters, shapes, strict=True))
            for shape in _rest(owner, model, w, rows, given)
        ]
        self.particles = [
            each[k] + model.offsets[w] for k, w in zip(self.order, self.world, strict=True)
        ]
        self._weigh([rest[k] for k in self.order])
        rows = np.bincount(color) if self.count else np.zeros(0, dtype=np.int64)
        chunks = np.concatenate([[0], np.cumsum([-(-len(row) // CHUNK) for row in self.particles])])
        edges = np.concatenate([[0], np.cumsum(rows)]).astype(int).tolist()
        self.chunk = chunks.astype(int)
        self.spans = [(a, b, *self.chunk[[a, b]].tolist()) for a, b in itertools.pairwise(edges)]

    def _weigh(self, rest: list[np.ndarray]) -> None:
        """Weights, and rest shapes from their centres of mass."""
        mass = self.model.column("mass")
        self.held = self.model.column("pinned") > 0
        self.weight, self.rest, self.centre = [], [], []
        self.mean = np.ones(self.count)
        for k, row in enumerate(self.particles):
            held = self.held[row]
            free = mass[row][~held]
            m = np.where(held, PINNED * free.sum() if len(free) else 1.0, mass[row])
            centre = m @ rest[k] / m.sum()
            q = rest[k] - centre
            q -= m @ q / m.sum()  # what rounding has left of it
            self.centre.append(centre)
            self.weight.append(m)
            self.rest.append(q)
            if len(free):
                self.mean[k] = free.mean()

    def struct(self, softness: np.ndarray, limit: np.ndarray, breakable: bool) -> Any:
        """The clusters as the kernels take them."""
        model = self.model
        result = clusters_type(model.precision)()
        ends = [0, *np.cumsum([len(row) for row in self.particles])]
        begin = [
            first
            for a, b in itertools.pairwise(ends)
            for first in range(a, b, CHUNK)
        ]  # fmt: skip
        m, q = np.concatenate(self.weight), np.concatenate(self.rest)
        columns = {
            "particle": (np.concatenate(self.particles), wp.int32),
            "rest": (q, wp.vec3d),
            "weight": (m, wp.float64),
            "begin": ([*begin, ends[-1]], wp.int32),
            "cluster": (np.repeat(np.arange(self.count), np.diff(self.chunk)), wp.int32),
            "chunk": (self.chunk, wp.int32),
            "world": (self.world, wp.int32),
            "total": ([each.sum() for each in self.weight], wp.float64),
            "size": (self.sizes(), wp.float64),
            "bias": (self.biases(), wp.vec3d),
            "softness": (softness, wp.float64),
            "limit": (limit, wp.float64),
        }
        for name, (values, kind) in columns.items():
            host = np.asarray(values)
            host = host.astype(np.int32) if kind is wp.int32 else host.astype(np.float64)
            setattr(result, name, model.array(host, kind))
        device = model.device
        result.shift = wp.zeros(len(m), dtype=model.precision.vec3, device=device)
        result.moments = wp.zeros(len(begin), dtype=Moments, device=device)
        kinds = {"turn": wp.quatd, "strain": wp.mat33d, "origin": wp.vec3d, "centre": wp.vec3d,
                 "goal": wp.mat33d, "torque": wp.vec3d}  # fmt: skip
        for name, kind in kinds.items():
            setattr(result, name, wp.zeros(self.count, dtype=kind, device=device))
        if breakable:
            result.broken = wp.zeros(self.count, dtype=wp.int32, device=device)
        return result

    def sizes(self) -> np.ndarray:
        """sum m q^2 of each cluster, over the members that are free, if any are."""
        free = [~self.held[row] for row in self.particles]
        each = zip(self.weight, self.rest, free, strict=True)
        return np.array([
            float((m * (f | ~f.any())) @ np.square(q).sum(axis=1)) for m, q, f in each
        ])  # fmt: skip

    def biases(self) -> np.ndarray:
        """sum m q of each cluster, which is 0 but for the rounding of q."""
        pairs = zip(self.weight, self.rest, strict=True)
        return np.array([[math.fsum(row) for row in (q * m[:, None]).T] for m, q in pairs])

    def spreads(self) -> np.ndarray:
        """sum m q q^T of each cluster, (n, 3, 3)."""
        pairs = zip(self.weight, self.rest, strict=True)
        return np.array([(q * m[:, None]).T @ q for m, q in pairs]).reshape(-1, 3, 3)


def colors(each: Sequence[list[np.ndarray]]) -> np.ndarray:
    """Colours of all worlds' clusters."""
    found = [topology.colors(rows) for rows in each]
    return np.concatenate([np.zeros(0, dtype=np.int32), *found])


def _rest(
    owner: str, model: Model, w: int, clusters: list[np.ndarray], given: list[np.ndarray] | None
) -> list[np.ndarray]:
    """Rest shapes of the clusters of world w, by default as they are at the start."""
    scene, box = model.scenes[w], model.box_start[w]
    shapes = []
    for n, row in enumerate(clusters):
        if row.max() >= scene.particle_count:
            raise validate.fail(
                owner, f"clusters[{n}]", f"hold indices from 0 to {scene.particle_count - 1}",
                int(row.max()), "index the scene's particles",
            )  # fmt: skip
        if given is not None:
            shapes.append(given[n])
        else:
            shapes.append(topology.nearest(scene.position[row] - scene.position[row[0]], box))
        across = np.ptp(shapes[-1], axis=0)
        # From the first member all others are looked for as nearest images, however it turns.
        reach = float(np.linalg.norm(shapes[-1] - shapes[-1][0], axis=1).max())
        narrow = box[box > 0].min(initial=np.inf)
        if reach > 0.5 * narrow:
            raise validate.fail(
                owner, f"clusters[{n}]",
                f"reach at most half a periodic length, {0.5 * narrow:g} [length], from its first "
                "particle", reach, "enlarge the box, or make more clusters",
            )  # fmt: skip
        model.squares_fit(owner, "clusters", across)
    return shapes
