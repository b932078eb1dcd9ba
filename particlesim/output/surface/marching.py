"""The surface of anisotropic kernels by marching cubes, on the device."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine.execution.launch import CHUNK, Launch, launch
from ...kernels.output import marching_cubes as cubes
from ...kernels.output import surface as kernels

CELL = 2.0  # of the hash grids, in smoothing lengths
CELLS_PER_PARTICLE, MAX_CELLS = 4, 256
STEPS = 4  # of the search for a vertex along its edge
CHUNKS_PER_THREAD = 16
FARTHEST = 2**20  # nodes along an axis, so that places in float32 are good to a part of a spacing
STRIDES = np.array([1 << 42, 1 << 21, 1])  # of a brick's key: 2^21 bricks along an axis
BELOW = 2**10  # bricks that there may be below the origin, for the kernels of those next to it
MERGE = 2**22  # keys of bricks that are held before they are made unique
SLACK = 1e-6  # of the places, added to the kernels' boxes: a dozen roundings in float32
FLATTEST = 0.25  # ratio of a kernel's axes, 1 / k_r of Yu and Turk
FEWEST = 6  # neighbours, N_epsilon

# The level on a flat face of a cubic lattice of spacing h / 1.3, half a spacing above the outermost
# layer. In the continuum, with isotropic kernels, it is ln 2: a particle at depth z has volume
# 1 / F(z), where F' = P is W summed over planes, and the integral of P / F from the face on is
# ln F(inf) - ln F(0).
LEVEL_ISOTROPIC = 0.613
SMOOTHED, LEVELS = (0.0, 0.25, 0.5, 0.75, 1.0), (0.456, 0.175, 0.0448, 0.0089, 0.0039)
DROP = (4.0 / 3.0 * np.pi) ** (-1 / 3) / 1.3  # radius of a particle's own volume, over h


@dataclass(frozen=True)
class Shape:
    """How kernels are shaped, and the level that is drawn; see ``kernels.surface.Shaping``."""

    level: float
    smoothing: float = 0.0
    flattest: float = 1.0
    fewest: int = 2**31 - 1
    alone: float = 1.0

    @classmethod
    def isotropic(cls, level: float | None) -> Shape:
        """SPH's own kernels: every particle counts as one on its own."""
        return cls(LEVEL_ISOTROPIC if level is None else level)

    @classmethod
    def anisotropic(cls, smoothing: float, level: float | None) -> Shape:
        """Kernels flattened along the surface."""
        if level is None:
            level = float(np.exp(np.interp(smoothing, SMOOTHED, np.log(LEVELS))))
        return cls(level, smoothing, FLATTEST, FEWEST, drop_scale(level))


def drop_scale(level: float) -> float:
    """Scale s of the kernel of a particle on its own, so that it is drawn with its own volume.

    Alone it has V = 1 / W(0), so that phi(r) = w(r / s) / s^3. At r = ``DROP`` this rises from 0
    at s = DROP / 2 to 1.7 at s = DROP; a level above that makes smaller drops.
    """
    low, high = DROP / 2, DROP
    for _ in range(50):
        s = 0.5 * (low + high)
        u = max(1 - 0.5 * DROP / s, 0.0)
        enough = u**4 * (1 + 2 * DROP / s) >= level * s**3
        low, high = (low, s) if enough else (s, high)
    return high


class Marching:
    """Marching cubes over the field of :mod:`particlesim.kernels.output.surface`.

    Args:
        smoothing_length: h [length].
        spacing: Of the nodes [length].
        shape: Of the kernels.
        node_limit: Most nodes.
        device: Warp's device.
        threads: On the CPU.
    """

    def __init__(
        self, smoothing_length: float, spacing: float, shape: Shape, node_limit: int,
        device: Any, threads: int,
    ):  # fmt: skip
        self.h, self.spacing, self.level = smoothing_length, spacing, shape.level
        self.step = spacing / smoothing_length
        self.node_limit, self.device = node_limit, device
        self.threads = threads if device.is_cpu else 1
        self.shaping = kernels.Shaping()
        for name in ("smoothing", "flattest", "fewest", "alone"):
            setattr(self.shaping, name, getattr(shape, name))
        self.ranges = self._array(cubes.RANGES, wp.int32)
        self.edges = self._array(cubes.EDGES, wp.int32)
        self.owners = self._array(cubes.OWNERS, wp.int32)
        self._pool: ThreadPoolExecutor | None = None

    def mesh(self, x: np.ndarray, mass: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points, triangles and normals of the surface around particles, (n, 3) and (n,)."""
        side = cubes.BRICK * self.spacing
        # A multiple of the bricks, so that nodes stay where they are from frame to frame.
        origin = side * np.floor(x.min(axis=0) / side)
        local = (x - origin) / self.h
        if local.max() > FARTHEST * self.step:
            raise validate.fail(
                "Surface.mesh", "spacing",
                f"be at least the fluid's extent over {FARTHEST} [length]", self.spacing,
                "use a coarser spacing, or look for a particle that has flown off",
            )  # fmt: skip
        order = cell_order(local)
        with self._threads():
            blobs, extent = self._blobs(local[order], mass[order])
            bricks = self._bricks(blobs.center.numpy(), extent.numpy())
            points, triangles, normals = self._march(bricks, blobs)
        return (points * self.h + origin).astype(np.float32), triangles, normals

    def _blobs(self, x: np.ndarray, mass: np.ndarray) -> tuple[Any, wp.array]:
        """The particles' kernels, and half the boxes that hold them."""
        count, device = len(x), self.device
        centers = self._array(x, wp.vec3)
        grid = self._grid(centers)
        blobs = kernels.Blobs()
        blobs.center = wp.empty(count, dtype=wp.vec3, device=device)
        blobs.stretch = wp.empty(count, dtype=wp.mat33, device=device)
        blobs.weight = wp.empty(count, dtype=wp.float32, device=device)
        extent = wp.empty(count, dtype=wp.vec3, device=device)
        inputs = [self.shaping, grid.id, centers, self._array(mass, wp.float32), blobs, extent]
        self._launch(kernels.shape_blobs, count, inputs)
        return blobs, extent

    def _bricks(self, center: np.ndarray, extent: np.ndarray) -> np.ndarray:
        """Places of the bricks that hold kernels, (b, 3), sorted.

        A kernel's box, from the node at or before it to the node behind it.
        """
        center, extent = center.astype(np.float64), extent + SLACK * (1 + center.max())
        low = np.floor((center - extent) / self.step).astype(np.int64) // cubes.BRICK
        high = np.floor((center + extent) / self.step + 1).astype(np.int64) // cubes.BRICK
        span = high - low + 1
        self._check_nodes(int(span.prod(axis=1, dtype=np.float64).max()))
        keys, found = _key(low), []
        for offset in np.ndindex(*span.max(axis=0)):
            reached = (span > offset).all(axis=1)
            found.append(np.unique(keys[reached] + np.array(offset) @ STRIDES))
            if sum(map(len, found)) > MERGE:
                found = [np.unique(np.concatenate(found))]
                self._check_nodes(len(found[0]))
        bricks = np.unique(np.concatenate(found))
        self._check_nodes(len(bricks))
        return _place(bricks)

    def _check_nodes(self, bricks: int) -> None:
        nodes = bricks * cubes.NODES
        if nodes > self.node_limit:
            raise validate.fail(
                "Surface.mesh", "spacing", f"make at most {self.node_limit} nodes", self.spacing,
                f"this makes {nodes} or more: use a coarser spacing, or raise node_limit",
            )  # fmt: skip

    def _march(self, bricks: np.ndarray, blobs: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The mesh of the level, in smoothing lengths."""
        device, count = self.device, len(bricks) * cubes.NODES
        places = self._array(bricks, wp.vec3i)
        following = self._array(_following(bricks), wp.int32)
        grid = self._grid(blobs.center)
        inside, crossed, case = (wp.empty(count, dtype=wp.uint8, device=device) for _ in range(3))
        pieces = [wp.empty(count, dtype=wp.int32, device=device) for _ in range(2)]
        field = [grid.id, blobs, self.step, self.level]
        self._launch(kernels.mark_inside, count, [places, *field, inside])
        inputs = [following, self.ranges, inside, crossed, case, *pieces]
        self._launch(cubes.count_pieces, count, inputs)
        (vertex, vertices), (triangle, triangles) = (_starts(each) for each in pieces)
        edges = wp.empty(vertices, dtype=wp.vec2i, device=device)
        corners = wp.empty(triangles, dtype=wp.vec3i, device=device)
        points, normals = (wp.empty(vertices, dtype=wp.vec3, device=device) for _ in range(2))
        self._launch(cubes.list_edges, count, [crossed, vertex, edges])
        self._launch(
            kernels.place_vertices, vertices,
            [places, edges, inside, *field, STEPS, points, normals],
        )  # fmt: skip
        self._launch(
            cubes.list_triangles, count,
            [following, self.ranges, self.edges, self.owners, case, crossed, vertex, triangle,
             corners],
        )  # fmt: skip
        return points.numpy().astype(np.float64), corners.numpy().copy(), normals.numpy().copy()

    def _grid(self, x: wp.array) -> wp.HashGrid:
        """A hash grid of points at and above the origin."""
        upper = x.numpy().max(axis=0)
        cells = np.clip(np.floor(upper / CELL) + 1, 1, MAX_CELLS)
        while np.prod(cells) > max(4096, CELLS_PER_PARTICLE * len(x)):
            cells[np.argmax(cells)] = np.ceil(cells.max() / 2)
        grid = wp.HashGrid(*(int(each) for each in cells), device=self.device)
        grid.build(x, CELL)
        return grid

    def _array(self, values: Any, dtype: Any) -> wp.array:
        return wp.array(np.ascontiguousarray(values), dtype=dtype, device=self.device)

    @contextmanager
    def _threads(self) -> Iterator[None]:
        """Threads for the launches made inside."""
        if self.threads < 2:
            yield
            return
        try:
            with ThreadPoolExecutor(self.threads) as self._pool:
                yield
        finally:
            self._pool = None

    def _launch(self, kernel: Any, count: int, inputs: Sequence[Any]) -> None:
        """Launch over ``count`` rows, in chunks on the threads if there are any."""
        if self._pool is None or count < 2 * CHUNK:
            launch(kernel, count, inputs, self.device)
            return
        whole = Launch(kernel, count, inputs, self.device)
        chunks = whole.record(self.threads * CHUNKS_PER_THREAD)
        list(self._pool.map(lambda chunk: chunk.launch(), chunks))


def cell_order(x: np.ndarray) -> np.ndarray:
    """Particles in the order of the cells, so that neighbours lie close in memory."""
    cell = np.floor(x / CELL).astype(np.int64)
    return np.lexsort((cell[:, 0], cell[:, 1], cell[:, 2]))


def _key(bricks: np.ndarray) -> np.ndarray:
    """One number for a brick's place, in the order of the places."""
    return (bricks + BELOW) @ STRIDES


def _place(keys: np.ndarray) -> np.ndarray:
    return np.stack([keys // stride % STRIDES[1] for stride in STRIDES], axis=1) - BELOW


def _following(bricks: np.ndarray) -> np.ndarray:
    """For each brick, the numbers of the eight bricks from it to (1, 1, 1) beyond; -1 for none."""
    keys = _key(bricks)
    columns = []
    for offset in itertools.product((0, 1), repeat=3):
        wanted = _key(bricks + offset)
        at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
        columns.append(np.where(keys[at] == wanted, at, -1))
    return np.stack(columns, axis=1).astype(np.int32)


def _starts(counts: wp.array) -> tuple[wp.array, int]:
    """Where each one's pieces start, and how many there are."""
    ends = wp.empty_like(counts)
    wp.utils.array_scan(counts, ends, inclusive=True)
    total = int(ends[-1:].numpy()[0])
    starts = wp.empty_like(counts)
    wp.utils.array_scan(counts, starts, inclusive=False)
    return starts, total
