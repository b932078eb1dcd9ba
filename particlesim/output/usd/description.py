"""What a recording holds, described on the host: groups, links, meshes, boundaries, the stage.

What a description leaves open as None (rows, pairs, triangles) comes with every frame, and may be
more or less from one frame to the next.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ... import validate
from .shapes import Color, Shape, named, replace

__all__ = ["Color", "LinksPrim", "MeshPrim", "PointsPrim", "Shape", "StageInfo"]


@dataclass(frozen=True, eq=False)
class PointsPrim:
    """One group of one world, drawn as ``UsdGeomPoints``.

    Args:
        world: Number of the world, from 0.
        name: Name of the group; made a valid and unique prim name.
        indices: Rows of the frame arrays, a slice with both ends or (n,) int; None: they and the
            ids come with every frame.
        ids: (n,) int, the same for one particle in every frame; None with the indices.
        widths: Diameters, one for all or (n,) [length]. None: a hundredth of the diagonal of the
            first frame, for particles without a size.
        color: (r, g, b) in 0..1, linear.
        instancer: Draw a ``UsdGeomPointInstancer`` of spheres instead.
    """

    world: int
    name: str
    indices: np.ndarray | slice | None
    ids: np.ndarray | None
    widths: np.ndarray | float | None
    color: Color
    instancer: bool = False

    def __post_init__(self) -> None:
        owner = "PointsPrim"
        named(owner, self)
        if self.indices is None:
            if self.ids is not None or isinstance(self.widths, np.ndarray):
                raise validate.fail(
                    owner, "ids and widths", "be None and one number where indices are None",
                    (self.ids, self.widths), "give ids with every frame, widths as a field",
                )  # fmt: skip
            count = 0
        else:
            replace(self, "indices", row_indices(owner, "indices", self.indices))
            count = len(self.rows)
            replace(self, "ids", particle_ids(owner, self.ids, count))
        if self.widths is not None:
            replace(self, "widths", _widths(owner, self.widths, count))

    @property
    def rows(self) -> np.ndarray:
        """Rows of the frame arrays, in order, (n,) int; none where they come with the frames."""
        return _listed(self.indices)


@dataclass(frozen=True, eq=False)
class LinksPrim:
    """Pairs of particles of one world (ropes, springs, bonds), drawn as straight curves.

    Args:
        world: Number of the world, from 0.
        name: Name of the links; made a valid and unique prim name.
        pairs: (m, 2) int, rows of the frame arrays; None: they come with every frame.
        width: Diameter of the curves [length].
        color: (r, g, b) in 0..1, linear.
    """

    world: int
    name: str
    pairs: np.ndarray | None
    width: float
    color: Color

    def __post_init__(self) -> None:
        owner = "LinksPrim"
        named(owner, self)
        if self.pairs is not None:
            replace(self, "pairs", row_pairs(owner, self.pairs))
        replace(self, "width", validate.number(owner, "width", self.width, above=0, unit="length"))


@dataclass(frozen=True, eq=False)
class MeshPrim:
    """A surface of one world, drawn as ``UsdGeomMesh`` of triangles with vertex normals.

    Args:
        world: Number of the world, from 0.
        name: Name of the surface; made a valid and unique prim name.
        color: (r, g, b) in 0..1, linear.
        indices: Rows of the frame arrays, a slice with both ends or (n,) int, for a surface that
            is spanned by particles. Then normals are the area-weighted means of the triangles.
        triangles: (t, 3) int into the surface's own points, counterclockwise from outside. None:
            they come with every frame, without indices as points, triangles and normals.
    """

    world: int
    name: str
    color: Color
    indices: np.ndarray | slice | None = None
    triangles: np.ndarray | None = None

    def __post_init__(self) -> None:
        owner = "MeshPrim"
        named(owner, self)
        if self.indices is None and self.triangles is not None:
            raise validate.fail(
                owner, "triangles", "be None without indices", self.triangles,
                "give both, or all with every frame",
            )  # fmt: skip
        if self.indices is not None:
            replace(self, "indices", row_indices(owner, "indices", self.indices))
        if self.triangles is not None:
            checked = validate.triangles(owner, self.triangles, len(self.rows), proper=False)
            replace(self, "triangles", checked)

    @property
    def rows(self) -> np.ndarray:
        """Rows of the frame arrays, in order, (n,) int; none where points come with the frames."""
        return _listed(self.indices)


@dataclass(frozen=True, eq=False, kw_only=True)
class StageInfo:
    """What a recording holds besides the frames.

    Args:
        points: The groups.
        links: Pairs to draw.
        meshes: Surfaces to draw; there is at least one group or one surface.
        shapes: Boundaries to draw.
        layout: Where a world is put, by its number, (3,) [length]: the transform of its
            ``/World/env_####``, which no points know of. Worlds that are left out stay.
        frames: How many frames are planned, the start state included. More or fewer may come.
        fps: Frames a second of playback [1/s].
        frame_time: Simulated time between two frames [time]. Authored velocities are scaled by
            ``frame_time * fps``, so that ``points + velocities / fps`` is about the next frame.
            None: ``1 / fps``, playback in real time.
        up_axis: ``"y"`` or ``"z"``.
        meters_per_unit: Length of one unit [m].
        periodic: ``(lower, upper)`` corners of a periodic box [length], drawn as an outline; links
            then take the short way. None or NaN on an axis leaves it open.
        flexible: Whether its upper corner moves, and frames say where it is.

    Raises:
        ValueError: A value out of range, ``up_axis="x"`` (USD knows Y and Z only), nothing to draw.
    """

    points: Sequence[PointsPrim] = ()
    links: Sequence[LinksPrim] = ()
    meshes: Sequence[MeshPrim] = ()
    shapes: Sequence[Shape] = ()
    layout: Mapping[int, Any] | None = None
    frames: int = 1
    fps: float = 60.0
    frame_time: float | None = None
    up_axis: str = "y"
    meters_per_unit: float = 1.0
    periodic: Any = None
    flexible: bool = False

    def __post_init__(self) -> None:
        owner = "StageInfo"
        if self.up_axis not in ("y", "z"):
            raise validate.fail(
                owner, "up_axis", "be 'y' or 'z' in USD", self.up_axis, "turn the scene"
            )
        validate.number(owner, "meters_per_unit", self.meters_per_unit, above=0, unit="m")
        validate.number(owner, "fps", self.fps, above=0, unit="1/s")
        validate.whole(owner, "frames", self.frames, minimum=1)
        if self.frame_time is not None:
            validate.number(owner, "frame_time", self.frame_time, above=0, unit="time")
        if not self.points and not self.meshes:
            raise validate.fail(
                owner, "points", "hold a group, or meshes a surface", self.points, "give one"
            )
        offsets = {
            validate.whole(owner, "layout", world): validate.vector(owner, "layout", offset)
            for world, offset in (self.layout or {}).items()
        }
        replace(self, "layout", offsets)
        if self.periodic is not None:
            replace(self, "periodic", _corners(owner, self.periodic))

    @property
    def velocity_scale(self) -> float:
        """Simulated time a second of playback: velocities are authored per second of playback."""
        return 1.0 if self.frame_time is None else self.frame_time * self.fps

    def offset(self, world: int) -> np.ndarray:
        """Where a world is put, (3,) [length]."""
        return (self.layout or {}).get(world, np.zeros(3))

    @property
    def worlds(self) -> list[int]:
        """The worlds that something is drawn of."""
        parts: list[Any] = [*self.points, *self.links, *self.meshes, *self.shapes]
        return sorted({part.world for part in parts})


def _listed(indices: np.ndarray | slice | None) -> np.ndarray:
    if isinstance(indices, slice):
        return np.arange(indices.start, indices.stop)
    return np.zeros(0, dtype=np.int64) if indices is None else indices


def row_indices(owner: str, name: str, given: Any, *, empty: bool = False) -> Any:
    """A slice with both ends, or whole numbers from 0; at least one row unless ``empty``."""
    if isinstance(given, slice):
        ends = (given.start, given.stop)
        if None in ends or given.step not in (None, 1) or not 0 <= ends[0] < ends[1]:
            raise validate.fail(owner, name, "have both ends and a row", given, "give slice(a, b)")
        return given
    array = np.asarray(given)
    if empty and array.size == 0:
        return np.zeros(0, dtype=np.int64)
    if array.ndim != 1 or not len(array) or not np.issubdtype(array.dtype, np.integer):
        raise validate.fail(owner, name, "be at least one row", given, "give whole numbers")
    if array.min() < 0:
        raise validate.fail(owner, name, "be at least 0", int(array.min()), "count from 0")
    return array.astype(np.int64)


def row_pairs(owner: str, given: Any, *, empty: bool = False) -> np.ndarray:
    """Pairs of rows, (m, 2) int64; at least one unless ``empty``."""
    pairs = np.asarray(given)
    if empty and pairs.size == 0:
        return np.zeros((0, 2), dtype=np.int64)
    if pairs.ndim != 2 or pairs.shape[1] != 2:
        raise validate.fail(owner, "pairs", "have shape (m, 2)", pairs.shape, "give two a link")
    return row_indices(owner, "pairs", pairs.ravel()).reshape(-1, 2)


def particle_ids(owner: str, given: Any, count: int) -> np.ndarray:
    """Numbers of particles, (count,) int64, that fit into 32 bits."""
    ids = np.asarray(given)
    if count == 0 and ids.size == 0:
        return np.zeros(0, dtype=np.int64)
    if ids.shape != (count,) or not np.issubdtype(ids.dtype, np.integer):
        raise validate.fail(owner, "ids", f"be {count} whole numbers", ids, "give one a row")
    if ids.min() < 0 or ids.max() > np.iinfo(np.int32).max:
        raise validate.fail(owner, "ids", "be in 0..2^31 - 1", ids, "count from 0")
    # Most are in order, and need no sorting to be told apart.
    if not (np.diff(ids) > 0).all() and len(np.unique(ids)) < count:
        raise validate.fail(owner, "ids", "be different", ids, "give every particle its own")
    return ids.astype(np.int64)


def _widths(owner: str, given: Any, count: int) -> np.ndarray | float:
    """One diameter, or (n,) float32."""
    if np.ndim(given) == 0:
        return validate.number(owner, "widths", given, minimum=0, unit="length")
    array = validate.rows(owner, "widths", given, count, None)
    if array.min() < 0:
        raise validate.fail(
            owner, "widths", "be at least 0 [length]", array.min(), "give diameters"
        )
    return array.astype(np.float32)


def _corners(owner: str, given: Any) -> np.ndarray:
    """Lower and upper corner, (2, 3), NaN on open axes."""
    corners = np.array(given, dtype=np.float64)
    if corners.shape != (2, 3):
        raise validate.fail(owner, "periodic", "be (lower, upper), three each", given, "give both")
    if np.any(corners[1] <= corners[0]):
        raise validate.fail(owner, "periodic", "have upper above lower", given, "swap them")
    return np.where(np.isfinite(corners).all(axis=0), corners, np.nan)
