"""Screen: shapes as a view sees them, and the nearest one of every sample."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import warp as wp

from ...engine.execution.executors import available_threads
from ...engine.execution.launch import Launch
from ...engine.execution.threads import Chain, Team
from ...engine.start import start_warp
from ...kernels.pictures import draw as render_draw
from ...kernels.pictures import view as render_view
from ...kernels.pictures.shapes import Shapes

CHUNKS_PER_THREAD = 16  # so that a thread that is held up does not hold up the others
LEAST = 16  # rows of a chunk: a tile of the picture is much work


class Crew:
    """Runs launches one after the other, each cut into chunks where there are threads.

    Args:
        device: Warp's name of a device; None: CUDA where there is one, else the CPU.
        threads: Of the CPU; None: as many as there are cores.
    """

    def __init__(self, device: Any = None, threads: int | None = None):
        start_warp()
        self.device = wp.get_device(device)
        self.threads = (threads or available_threads()) if self.device.is_cpu else 1
        self._kept: dict[str, wp.array] = {}
        self._team = Team(self.threads) if self.threads > 1 else None

    def launch(self, kernel: Any, dim: int, inputs: Sequence[Any]) -> None:
        """Run ``kernel`` over ``dim`` rows; on the CPU it is done on return."""
        if dim == 0:
            return
        operation = Launch(kernel, dim, inputs, self.device)
        if self._team is None:
            operation.issue()
            return
        self._team.run(Chain([operation.record(self.threads * CHUNKS_PER_THREAD, LEAST)]))

    def array(self, values: Any, dtype: Any) -> wp.array:
        """A NumPy array on the device; on the CPU the same memory."""
        return wp.array(values, dtype=dtype, device=self.device, copy=not self.device.is_cpu)

    def empty(self, shape: Any, dtype: Any) -> wp.array:
        """Memory on the device."""
        return wp.empty(shape, dtype=dtype, device=self.device)

    def kept(self, name: str, shape: tuple[int, int], dtype: Any) -> wp.array:
        """Memory that the next picture of this size uses again: new memory costs its first use."""
        found = self._kept.get(name)
        if found is None or found.shape != shape or found.dtype != dtype:
            found = self._kept[name] = self.empty(shape, dtype)
        return found

    def close(self) -> None:
        """End the threads."""
        if self._team is not None:
            self._team.close()
            self._team = None


MOST_PAIRS = 1 << 22  # of tiles and shapes in one list; a longer one is made in parts


def make_view(
    axes: np.ndarray,
    eye: np.ndarray,
    slope: tuple[float, float],
    width: int,
    height: int,
    near: float,
    parallel: bool = False,
    least: float = 0.0,
) -> Any:
    """The kernels' view (see :mod:`particlesim.kernels.pictures.view`).

    ``least``: radius of the smallest spheres, in samples.
    """
    view = render_view.View()
    view.right, view.up, view.back = (wp.vec3(*map(float, axis)) for axis in axes)
    view.eye = wp.vec3(*map(float, eye))
    view.slope = wp.vec2(*slope)
    view.sample = wp.vec2(2.0 * slope[0] / width, 2.0 * slope[1] / height)
    view.width, view.height = width, height
    view.tiles_x = math.ceil(width / int(render_view.TILE))
    view.near, view.parallel, view.least = near, float(parallel), least * view.sample[1]
    return view


def tile_count(view: Any) -> int:
    """Tiles of a view's screen."""
    return view.tiles_x * math.ceil(view.height / int(render_view.TILE))


class Lists:
    """Which shapes each tile of a view holds.

    Args:
        crew: Runs the kernels.
        view: The view.
        boxes: Samples of each shape, ``vec4i``.
        nearest: Smallest depth of each, ``float32``.
        counts: How many tiles each touches, ``int32``.
    """

    def __init__(self, crew: Crew, view: Any, boxes: wp.array, nearest: wp.array, counts: wp.array):
        self.crew, self.view, self.boxes, self.nearest = crew, view, boxes, nearest
        self.tile_count = tile_count(view)
        # What a key of 32 bits has left beside the tile, for the order of depths.
        self.depth_bits = 32 - self.tile_count.bit_length()
        self.ends = np.cumsum(counts.numpy(), dtype=np.int64)

    def parts(self) -> Iterator[tuple[wp.array, wp.array]]:
        """(start of each tile, shapes), of at most ``MOST_PAIRS`` at a time, shapes in order."""
        first, done = 0, 0
        while first < len(self.ends):
            last = max(first + 1, int(np.searchsorted(self.ends, done + MOST_PAIRS, side="right")))
            yield self._part(first, last, done, int(self.ends[last - 1]) - done)
            first, done = last, int(self.ends[last - 1])

    def whole(self) -> tuple[wp.array, wp.array]:
        """All of them in one list."""
        return self._part(0, len(self.ends), 0, int(self.ends[-1]))

    def _part(self, first: int, last: int, before: int, pairs: int) -> tuple[wp.array, wp.array]:
        crew = self.crew
        places = np.zeros(last - first, dtype=np.int32)
        places[1:] = self.ends[first : last - 1] - before
        key = crew.empty(max(2 * pairs, 1), wp.uint32)  # twice: room to sort in
        listed = crew.empty(max(2 * pairs, 1), wp.int32)
        crew.launch(
            render_view.list_tiles, last - first,
            [first, self.view.tiles_x, self.depth_bits, self.boxes, self.nearest,
             crew.array(places, wp.int32), key, listed],
        )  # fmt: skip
        wp.utils.radix_sort_pairs(key, listed, pairs)
        start = crew.empty(self.tile_count + 1, wp.int32)
        crew.launch(
            render_view.find_tiles, self.tile_count + 1, [pairs, self.depth_bits, key, start]
        )
        return start, listed


class Screen:
    """Solid shapes seen in a view.

    Args:
        crew: Runs the kernels.
        name: Of the memory that its pixels are kept in.
        view: The view.
        solids: Spheres, ends of cones and corners of triangles, in the scene's space, by
            ``ball``, ``cone`` and ``corner``.
        ground: A plane to see where nothing else is: normal in the view's space, and how far
            the view's origin is above it [length]; None: no ground.
    """

    def __init__(
        self,
        crew: Crew,
        name: str,
        view: Any,
        solids: dict[str, wp.array],
        ground: tuple[np.ndarray, float] | None = None,
    ):
        self.view = view
        size = (view.height, view.width)
        self.depth = crew.kept(f"{name} depth", size, wp.float32)
        self.shape = crew.kept(f"{name} shape", size, wp.int32)
        normal, height = (np.zeros(3), 0.0) if ground is None else ground
        crew.launch(
            render_draw.clear_tiles, tile_count(view),
            [view, wp.vec3(*normal), height, self.depth, self.shape],
        )  # fmt: skip
        self.shapes, lists = placed(crew, view, **solids)
        for start, listed in lists.parts():
            crew.launch(
                render_draw.draw_tiles, lists.tile_count,
                [view, self.shapes, lists.boxes, lists.nearest, start, listed, self.depth,
                 self.shape],
            )  # fmt: skip


def placed(
    crew: Crew, view: Any, ball: wp.array, cone: wp.array, corner: wp.array
) -> tuple[Any, Lists]:
    """Shapes in the view's space, and which tiles they are in."""
    shapes = Shapes()
    spheres, cones, triangles = len(ball), len(cone) // 2, len(corner) // 3
    shapes.sphere_count, shapes.cone_count = spheres, cones
    shapes.ball = crew.empty(spheres, wp.vec4)
    shapes.cone = crew.empty(2 * cones, wp.vec4)
    shapes.corner = crew.empty(3 * triangles, wp.vec3)
    boxes = crew.empty(spheres + cones + triangles, wp.vec4i)
    counts = wp.zeros(spheres + cones + triangles, dtype=wp.int32, device=crew.device)
    nearest = crew.empty(spheres + cones + triangles, wp.float32)
    found = [boxes, nearest, counts]
    crew.launch(render_view.place_spheres, spheres, [view, ball, shapes.ball, *found])
    crew.launch(render_view.place_cones, cones, [view, spheres, cone, shapes.cone, *found])
    crew.launch(
        render_view.place_triangles, triangles,
        [view, spheres + cones, corner, shapes.corner, *found],
    )  # fmt: skip
    return shapes, Lists(crew, view, *found)
