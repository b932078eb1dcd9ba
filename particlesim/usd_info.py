"""What a recording holds, described on the host: groups, links, boundaries and the stage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import validate

SHAPES = ("plane", "box", "sphere")
Color = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class PointsPrim:
    """One group of one world, drawn as ``UsdGeomPoints``.

    Args:
        world: Number of the world, from 0.
        name: Name of the group; made a valid and unique prim name.
        indices: Rows of the frame arrays, a slice with both ends or (n,) int.
        ids: (n,) int, the same for one particle in every frame.
        widths: Diameters, one for all or (n,) [length]. None: a hundredth of the diagonal of the
            first frame, for particles without a size.
        color: (r, g, b) in 0..1, linear.
    """

    world: int
    name: str
    indices: np.ndarray | slice
    ids: np.ndarray
    widths: np.ndarray | float | None
    color: Color

    def __post_init__(self) -> None:
        owner = "PointsPrim"
        _named(owner, self)
        _replace(self, "indices", _indices(owner, self.indices))
        count = len(self.rows)
        ids = np.asarray(self.ids)
        if ids.shape != (count,) or not np.issubdtype(ids.dtype, np.integer):
            raise validate.fail(owner, "ids", f"be {count} whole numbers", ids, "give one a row")
        if ids.min() < 0 or ids.max() > np.iinfo(np.int32).max:
            raise validate.fail(owner, "ids", "be in 0..2^31 - 1", ids, "count from 0")
        _replace(self, "ids", ids.astype(np.int64))
        if self.widths is not None:
            _replace(self, "widths", _widths(owner, self.widths, count))

    @property
    def rows(self) -> np.ndarray:
        """Rows of the frame arrays, in order, (n,) int."""
        if isinstance(self.indices, slice):
            return np.arange(self.indices.start, self.indices.stop)
        return self.indices


@dataclass(frozen=True, eq=False)
class LinksPrim:
    """Pairs of particles of one world (ropes, springs, bonds), drawn as straight curves.

    Args:
        world: Number of the world, from 0.
        name: Name of the links; made a valid and unique prim name.
        pairs: (m, 2) int, rows of the frame arrays.
        width: Diameter of the curves [length].
        color: (r, g, b) in 0..1, linear.
    """

    world: int
    name: str
    pairs: np.ndarray
    width: float
    color: Color

    def __post_init__(self) -> None:
        owner = "LinksPrim"
        _named(owner, self)
        pairs = np.asarray(self.pairs)
        if pairs.ndim != 2 or pairs.shape[1] != 2:
            raise validate.fail(owner, "pairs", "have shape (m, 2)", pairs.shape, "give two a link")
        _replace(self, "pairs", _indices(owner, pairs.ravel(), "pairs").reshape(-1, 2))
        _replace(self, "width", validate.number(owner, "width", self.width, above=0, unit="length"))


@dataclass(frozen=True, eq=False)
class Shape:
    """A boundary that does not move. Made by :meth:`plane`, :meth:`box` and :meth:`sphere`.

    Args:
        world: Number of the world, from 0.
        name: Name of the boundary; made a valid and unique prim name.
        kind: ``"plane"``, ``"box"`` or ``"sphere"``.
        parameters: (point, normal), (lower, upper) or (center, radius) [length].
        container: Particles live inside it, so it is drawn clear; otherwise solid. A plane is
            drawn clear where the camera is behind it.
        color: (r, g, b) in 0..1, linear.
    """

    world: int
    name: str
    kind: str
    parameters: tuple[Any, Any]
    container: bool = True
    color: Color = (0.5, 0.5, 0.5)

    def __post_init__(self) -> None:
        owner = "Shape"
        _named(owner, self)
        validate.choice(owner, "kind", self.kind, SHAPES)
        first, second = self.parameters
        names = {"plane": ("point", "normal"), "box": ("lower", "upper")}.get(self.kind)
        if names is None:
            first = validate.vector(owner, "center", first, unit="length")
            second = validate.number(owner, "radius", second, above=0, unit="length")
        else:
            first = validate.vector(owner, names[0], first, unit="length")
            second = validate.vector(owner, names[1], second)
        if self.kind == "plane" and not np.any(second):
            raise validate.fail(owner, "normal", "have a length", second, "give a direction")
        if self.kind == "box" and np.any(second <= first):
            raise validate.fail(owner, "upper", f"be above lower {first}", second, "swap them")
        _replace(self, "parameters", (first, second))

    @classmethod
    def plane(cls, point: Any, normal: Any, world: int = 0, name: str = "plane") -> Shape:
        """The plane through ``point`` [length]; particles are on the side of ``normal``."""
        return cls(world, name, "plane", (point, normal), container=False)

    @classmethod
    def box(
        cls, lower: Any, upper: Any, world: int = 0, name: str = "box", container: bool = True
    ) -> Shape:
        """The box between two corners [length]."""
        return cls(world, name, "box", (lower, upper), container)

    @classmethod
    def sphere(
        cls,
        center: Any,
        radius: float,
        world: int = 0,
        name: str = "sphere",
        container: bool = True,
    ) -> Shape:
        """The sphere around ``center`` [length]."""
        return cls(world, name, "sphere", (center, radius), container)


@dataclass(frozen=True, eq=False, kw_only=True)
class StageInfo:
    """What a recording holds besides the frames.

    Args:
        points: The groups, at least one.
        links: Pairs to draw.
        shapes: Boundaries to draw.
        frames: How many frames are planned, the start state included. More or fewer may come.
        fps: Frames a second of playback [1/s].
        frame_time: Simulated time between two frames [time]. Authored velocities are scaled by
            ``frame_time * fps``, so that ``points + velocities / fps`` is about the next frame.
            None: ``1 / fps``, playback in real time.
        up_axis: ``"y"`` or ``"z"``.
        meters_per_unit: Length of one unit [m].
        periodic: ``(lower, upper)`` corners of a periodic box [length], drawn as an outline; links
            then take the short way. None or NaN on an axis leaves it open.

    Raises:
        ValueError: A value out of range, ``up_axis="x"`` (USD knows Y and Z only), no points.
    """

    points: Sequence[PointsPrim]
    links: Sequence[LinksPrim] = ()
    shapes: Sequence[Shape] = ()
    frames: int = 1
    fps: float = 60.0
    frame_time: float | None = None
    up_axis: str = "y"
    meters_per_unit: float = 1.0
    periodic: Any = None

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
        if not self.points:
            raise validate.fail(owner, "points", "hold a group", self.points, "give a PointsPrim")
        if self.periodic is not None:
            corners = np.array(self.periodic, dtype=np.float64)
            if corners.shape != (2, 3):
                raise validate.fail(
                    owner, "periodic", "be (lower, upper), three each", self.periodic, "give both"
                )
            if np.any(corners[1] <= corners[0]):
                raise validate.fail(
                    owner, "periodic", "have upper above lower", self.periodic, "swap them"
                )
            both = np.isfinite(corners).all(axis=0)
            _replace(self, "periodic", np.where(both, corners, np.nan))

    @property
    def velocity_scale(self) -> float:
        """Simulated time a second of playback: velocities are authored per second of playback."""
        return 1.0 if self.frame_time is None else self.frame_time * self.fps


def _named(owner: str, prim: PointsPrim | LinksPrim | Shape) -> None:
    """Check what every part of a description has."""
    validate.whole(owner, "world", prim.world)
    if not isinstance(prim.name, str) or not prim.name:
        raise validate.fail(owner, "name", "be a word", prim.name, "give one")
    color = validate.vector(owner, "color", prim.color)
    if color.min() < 0 or color.max() > 1:
        raise validate.fail(owner, "color", "be in 0..1", prim.color, "give (r, g, b)")
    _replace(prim, "color", tuple(float(c) for c in color))


def _indices(owner: str, given: Any, name: str = "indices") -> Any:
    """A slice with both ends, or an array of whole numbers from 0; at least one row."""
    if isinstance(given, slice):
        ends = (given.start, given.stop)
        if None in ends or given.step not in (None, 1) or not 0 <= ends[0] < ends[1]:
            raise validate.fail(owner, name, "have both ends and a row", given, "give slice(a, b)")
        return given
    array = np.asarray(given)
    if array.ndim != 1 or not len(array) or not np.issubdtype(array.dtype, np.integer):
        raise validate.fail(owner, name, "be at least one row", given, "give whole numbers")
    if array.min() < 0:
        raise validate.fail(owner, name, "be at least 0", int(array.min()), "count from 0")
    return array.astype(np.int64)


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


def _replace(frozen: object, name: str, value: Any) -> None:
    """Set a checked value on a frozen dataclass under construction."""
    object.__setattr__(frozen, name, value)
