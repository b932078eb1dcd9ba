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
    """A boundary.

    Args:
        kind: ``"plane"``, ``"box"``, ``"sphere"`` or ``"mesh"``.
        parameters: (point, normal), to where particles are; (lower, upper); (center, radius); or
            (points (p, 3), triangles (t, 3) int, counterclockwise from outside); [length]. Of a
            moving shape, where it is before its pose moves it.
        world: Number of the world, from 0.
        name: Name of the boundary, by default its kind; made a valid and unique prim name.
        container: Particles live inside it, so it is drawn clear; otherwise solid. By default true
            of boxes and spheres. A plane is drawn clear where the camera is behind it.
        color: (r, g, b) in 0..1, linear.
        moving: Its pose comes with every frame: ``(translation, rotation)``, (3,) [length] and a
            (3, 3) matrix R, which take a point x of the shape to R x + translation.

    Raises:
        ValueError: A kind that is not known, parameters that make no such shape.

    Example:
        >>> Shape("sphere", ((0, 1, 0), 0.5)).parameters[1]
        0.5
    """

    kind: str
    parameters: tuple[Any, Any]
    world: int = 0
    name: str = ""
    container: bool | None = None
    color: Color = (0.5, 0.5, 0.5)
    moving: bool = False

    def __post_init__(self) -> None:
        validate.choice("Shape", "kind", self.kind, SHAPES)
        replace(self, "name", self.name or self.kind)
        named("Shape", self)
        replace(self, "parameters", _checked(self.kind, *self.parameters))

    @property
    def clear(self) -> bool:
        """Whether it is drawn clear."""
        return self.kind in ("box", "sphere") if self.container is None else self.container


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
