"""Combinations of boundaries: unions, intersections and complements of what is solid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine.model import Model
from ...kernels.constraints.boundaries import combined as kernels
from ...kernels.precision import Precision
from .drawing import extent, level_set, nodes, turned_over
from .motion import Motion
from .nearest import NearestBoundary
from .solid import STILL, SolidBoundary


class Combinable:
    """What can be combined with others to one boundary, by what is solid."""

    def __or__(self: Any, other: Any) -> Any:
        """What is solid of either: a :class:`~particlesim.UnionBoundary`."""
        return UnionBoundary(self, other)

    def __invert__(self: Any) -> Any:
        """What is open of this is solid: a :class:`~particlesim.ComplementBoundary`."""
        return ComplementBoundary(self)

    def __and__(self: Any, other: Any) -> Any:
        """What is solid of both."""
        return ~(~self | ~other)

    def __sub__(self: Any, other: Any) -> Any:
        """What is solid of this and not of the other."""
        return self & ~other


class ShapedBoundary(Combinable, NearestBoundary):
    """Base of boundaries by the nearest point of their surface (see ``NearestBoundary``)."""


class CombinedBoundary(ShapedBoundary):
    """Base of boundaries that are made of others."""

    sides = 3
    mixed = True

    def _combine(self, parts: Mapping[str, Any], pivot: Any) -> None:
        """The parts, checked, and what is the worst of them."""
        self.pivot = validate.vector(self.name, "pivot", pivot, unit="length")
        for name, part in parts.items():
            if not isinstance(part, SolidBoundary):
                raise validate.fail(self.name, name, "be a boundary", part, "give one")
            if part.moves or part.group is not None:
                raise validate.fail(
                    self.name, name, "be at rest and hold all, as the combination moves and holds",
                    part.name, f"give {self.name} its motion and its group",
                )  # fmt: skip
        self.parts = dict(parts)
        self.tracked = any(part.tracked for part in parts.values())
        # Of what is asked first; where it touches each part has its own.
        self.friction = max(part.friction for part in parts.values())
        self.restitution = max(part.restitution for part in parts.values())

    def kind(self) -> tuple[Any, ...]:
        return (*super().kind(), *(part.kind() for part in self.parts.values()))

    def width(self) -> float:
        return min(part.width() for part in self.parts.values())

    def _geometry(self, device: Any, precision: Precision) -> dict[str, Any]:
        inner = {
            name: {
                **part._geometry(device, precision),
                "friction": part.friction,
                "restitution": part.restitution,
            }
            for name, part in self.parts.items()
        }
        return {**inner, "room": np.inf}

    def _check(self, model: Model, w: int) -> None:
        super()._check(model, w)
        if not any(model.periodic):
            for part in self.parts.values():
                part._check(model, w)

    def _nears(self, precision: Precision, params: Any) -> list[wp.Function]:
        """Of the parts, by their structs within ``params``."""
        return [part.near(precision, params.vars[name].type) for name, part in self.parts.items()]

    def _touches(self, precision: Precision, params: Any) -> list[wp.Function]:
        return [part.touch(precision, params.vars[name].type) for name, part in self.parts.items()]

    def _level(self) -> list[dict[str, Any]]:
        """Its surface in the box around what of its parts is finite."""
        around = extent([shape for part in self.parts.values() for shape in part.shapes()])
        if around is None:
            return []
        places, counts = nodes(*around)
        mesh = level_set(self.distance(places).reshape(counts), *around)
        return [self._shape("mesh", **mesh)] if mesh else []


class UnionBoundary(CombinedBoundary):
    """What is solid of one boundary or of another: ``first | second``.

    The distance is the smaller of both, which is exact outside of them, and in the solid at most
    the depth. In a notch particles touch both. ``first & second`` is what is solid of both, and
    ``first - second`` of the first alone; there the distance is at most that from the surface, so
    that at an edge the corner of an offset is sharp. Friction and restitution are those of the part
    that is nearest.

    Args:
        first: A boundary at rest, of no group.
        second: Another.
        group: Which particles it holds; None: all.
        velocity: Of the boundary, (3,) [length/time].
        angular_velocity: About the pivot, (3,) [rad/time].
        pivot: What it turns about, as described, (3,) [length].
        slip: A fluid slips along it; False: a viscous one sticks to it.
        motion: A ``Trajectory`` or ``Keyframes`` in the place of both velocities.

    Raises:
        ValueError: A part that is no boundary, moves or has a group; values out of range; a
            periodic scene of which it has not the period.

    Example:
        >>> ball = SphereBoundary((0, 0, 0), 1.0, inside=False, friction=0.2)
        >>> floor = PlaneBoundary((0, -0.5, 0), (0, 1, 0), friction=0.6)
        >>> dome, lens = ball | floor, ball & floor
        >>> sorted(dome.parts), type(lens).__name__
        (['first', 'second'], 'ComplementBoundary')
    """

    def __init__(
        self, first: SolidBoundary, second: SolidBoundary, group: Any = None, *,
        velocity: Sequence[float] = STILL, angular_velocity: Sequence[float] = STILL,
        pivot: Sequence[float] = STILL, slip: bool = True, motion: Motion | None = None,
    ):  # fmt: skip
        self._holds(0.0, 0.0, group, velocity, angular_velocity, slip, motion)
        self._combine({"first": first, "second": second}, pivot)

    def near(self, precision: Precision, params: Any) -> wp.Function:
        return kernels.union_near(*self._nears(precision, params), precision, params)

    def touch(self, precision: Precision, params: Any) -> wp.Function:
        nears, touches = self._nears(precision, params), self._touches(precision, params)
        return kernels.union_touch((*nears,), (*touches,), precision, params)

    def shapes(self) -> list[dict[str, Any]]:
        found = [shape for part in self.parts.values() for shape in part.shapes()]
        moving = bool(self._shape("")["moving"])
        return [{**shape, "moving": moving} for shape in found]


class ComplementBoundary(CombinedBoundary):
    """What another boundary leaves open is solid, and what it fills is open: ``~part``.

    Args:
        part: A boundary at rest, of no group; of a sheet, which has no inside, nothing is open.
        group: Which particles it holds; None: all.
        velocity: Of the boundary, (3,) [length/time].
        angular_velocity: About the pivot, (3,) [rad/time].
        pivot: What it turns about, as described, (3,) [length].
        slip: A fluid slips along it; False: a viscous one sticks to it.
        motion: A ``Trajectory`` or ``Keyframes`` in the place of both velocities.

    Raises:
        ValueError: A part that is no boundary, moves or has a group; values out of range; a
            periodic scene of which it has not the period.

    Example:
        >>> block = ~BoxBoundary((0, 0, 0), (1, 1, 1), friction=0.5)
        >>> block.friction
        0.5
    """

    def __init__(
        self, part: SolidBoundary, group: Any = None, *, velocity: Sequence[float] = STILL,
        angular_velocity: Sequence[float] = STILL, pivot: Sequence[float] = STILL,
        slip: bool = True, motion: Motion | None = None,
    ):  # fmt: skip
        self._holds(0.0, 0.0, group, velocity, angular_velocity, slip, motion)
        self._combine({"part": part}, pivot)

    def near(self, precision: Precision, params: Any) -> wp.Function:
        return kernels.complement_near(*self._nears(precision, params), precision, params)

    def touch(self, precision: Precision, params: Any) -> wp.Function:
        return kernels.complement_touch(*self._touches(precision, params), precision, params)

    def shapes(self) -> list[dict[str, Any]]:
        part = self.parts["part"]
        if isinstance(part, CombinedBoundary):
            return self._level()
        moving = bool(self._shape("")["moving"])
        return [{**turned_over(shape), "moving": moving} for shape in part.shapes()]
