"""Shape: a boundary as a recording draws it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ... import validate

# What the two parameters of each kind are.
SHAPES = {
    "plane": ("point", "normal"),
    "box": ("lower", "upper"),
    "sphere": ("center", "radius"),
    "mesh": ("points", "triangles"),
}
Color = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Shape:
    """A boundary. Made by :meth:`plane`, :meth:`box`, :meth:`sphere` and :meth:`mesh`.

    Args:
        world: Number of the world, from 0.
        name: Name of the boundary; made a valid and unique prim name.
        kind: ``"plane"``, ``"box"``, ``"sphere"`` or ``"mesh"``.
        parameters: (point, normal), (lower, upper), (center, radius) or (points (p, 3), triangles
            (t, 3) int), [length]; of a moving shape, where it is before its pose moves it.
        container: Particles live inside it, so it is drawn clear; otherwise solid. A plane is
            drawn clear where the camera is behind it.
        color: (r, g, b) in 0..1, linear.
        moving: Its pose comes with every frame: ``(translation, rotation)``, (3,) [length] and a
            (3, 3) matrix R, which take a point x of the shape to R x + translation.

    Raises:
        ValueError: A kind that is not known, parameters that make no such shape.

    Example:
        >>> Shape.sphere((0, 1, 0), 0.5).parameters[1]
        0.5
    """

    world: int
    name: str
    kind: str
    parameters: tuple[Any, Any]
    container: bool = True
    color: Color = (0.5, 0.5, 0.5)
    moving: bool = False

    def __post_init__(self) -> None:
        named("Shape", self)
        validate.choice("Shape", "kind", self.kind, SHAPES)
        replace(self, "parameters", _checked(self.kind, *self.parameters))

    @classmethod
    def plane(
        cls, point: Any, normal: Any, world: int = 0, name: str = "plane", moving: bool = False
    ) -> Shape:
        """The plane through ``point`` [length]; particles are on the side of ``normal``."""
        return cls(world, name, "plane", (point, normal), container=False, moving=moving)

    @classmethod
    def box(
        cls, lower: Any, upper: Any, world: int = 0, name: str = "box", container: bool = True,
        moving: bool = False,
    ) -> Shape:  # fmt: skip
        """The box between two corners [length]."""
        return cls(world, name, "box", (lower, upper), container, moving=moving)

    @classmethod
    def sphere(
        cls, center: Any, radius: float, world: int = 0, name: str = "sphere",
        container: bool = True, moving: bool = False,
    ) -> Shape:  # fmt: skip
        """The sphere around ``center`` [length]."""
        return cls(world, name, "sphere", (center, radius), container, moving=moving)

    @classmethod
    def mesh(
        cls, points: Any, triangles: Any, world: int = 0, name: str = "mesh",
        container: bool = False, moving: bool = False,
    ) -> Shape:  # fmt: skip
        """Triangles (t, 3) int between points (p, 3) [length], counterclockwise from outside."""
        return cls(world, name, "mesh", (points, triangles), container, moving=moving)


def _checked(kind: str, first: Any, second: Any) -> tuple[Any, Any]:
    """The parameters of a kind as arrays and numbers."""
    owner = "Shape"
    names = SHAPES[kind]
    if kind == "mesh":
        points = validate.rows(owner, names[0], first, None, 3)
        return points, validate.triangles(owner, second, len(points), proper=False)
    first = validate.vector(owner, names[0], first, unit="length")
    if kind == "sphere":
        return first, validate.number(owner, names[1], second, above=0, unit="length")
    second = validate.vector(owner, names[1], second)
    if kind == "plane" and not np.any(second):
        raise validate.fail(owner, "normal", "have a length", second, "give a direction")
    if kind == "box" and np.any(second <= first):
        raise validate.fail(owner, "upper", f"be above lower {first}", second, "swap them")
    return first, second


def named(owner: str, prim: Any) -> None:
    """Check what every part of a description has: world, name and colour."""
    validate.whole(owner, "world", prim.world)
    if not isinstance(prim.name, str) or not prim.name:
        raise validate.fail(owner, "name", "be a word", prim.name, "give one")
    color = validate.vector(owner, "color", prim.color)
    if color.min() < 0 or color.max() > 1:
        raise validate.fail(owner, "color", "be in 0..1", prim.color, "give (r, g, b)")
    replace(prim, "color", tuple(float(c) for c in color))


def replace(frozen: object, name: str, value: Any) -> None:
    """Set a checked value on a frozen dataclass under construction."""
    object.__setattr__(frozen, name, value)
