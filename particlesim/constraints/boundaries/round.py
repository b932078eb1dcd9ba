"""Boundaries about an axis: capsules and cylinders."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...kernels.constraints.boundaries import round as kernels
from ...kernels.precision import Precision
from .combined import ShapedBoundary
from .drawing import revolved
from .motion import Motion
from .solid import STILL


class RoundBoundary(ShapedBoundary):
    """Base of boundaries about the axis from ``start`` to ``end``; they turn about its middle."""

    def _round(self, start: Any, end: Any, radius: Any, inside: bool) -> None:
        """The axis, checked."""
        self.start = validate.vector(self.name, "start", start, unit="length")
        self.end = validate.vector(self.name, "end", end, unit="length")
        self.radius = validate.number(self.name, "radius", radius, above=0.0, unit="length")
        self.inside = bool(inside)
        way = self.end - self.start
        longest = np.abs(way).max()
        if not longest > 0:
            raise validate.fail(
                self.name, "end", f"differ from start {self.start.tolist()} [length]", self.end,
                "give two ends",
            )  # fmt: skip
        length = np.linalg.norm(way / longest)  # so that squares neither overflow nor vanish
        self.axis, self.half = way / longest / length, 0.5 * float(longest * length)
        aside = np.eye(3)[np.argmin(np.abs(self.axis))]
        aside = aside - self.axis * (aside @ self.axis)
        self.aside = aside / np.linalg.norm(aside)

    def _geometry(self, device: Any, precision: Precision) -> dict[str, Any]:
        return {
            "center": self._pivot(), "axis": self.axis, "aside": self.aside, "half": self.half,
            "radius": self.radius, "inside": int(self.inside),
            "room": self._room() if self.inside else np.inf,
        }  # fmt: skip

    def _room(self) -> float:
        """The largest ball that it holds."""
        return self.radius

    def width(self) -> float:
        return self._room()

    def _pivot(self) -> np.ndarray:
        return 0.5 * self.start + 0.5 * self.end

    def _carried(self) -> tuple[np.ndarray, np.ndarray]:
        # About its axis it turns in itself.
        along = np.abs(np.cross(self.axis, self.angular_velocity)).max()
        turns = along > 1e-14 * np.abs(self.angular_velocity).max()
        return self.velocity, self.angular_velocity if turns else np.zeros(3)

    def _drawn(self, profile: np.ndarray) -> list[dict[str, Any]]:
        """The surface whose points are at (r, z) from the middle."""
        points, triangles = revolved(profile, self._pivot(), self.axis, self.aside)
        mesh = {"points": points, "triangles": triangles, "container": self.inside}
        return [self._shape("mesh", **mesh)]


class CapsuleBoundary(RoundBoundary):
    """The outside of a capsule, what is nearer to a segment than the radius, or its inside.

    From the outside, what crosses the axis in one substep leaves on the other side.

    Args:
        start: First end of the segment [length], (3,).
        end: The other end [length], (3,).
        radius: Distance of the surface from the segment [length], above 0.
        inside: True: a container; False: an obstacle.
        friction: mu, at least 0.
        restitution: e, 0 to 1: speed after over speed before, both against the surface's.
        group: Which particles it holds; None: all.
        velocity: Of the capsule, (3,) [length/time].
        angular_velocity: About the middle of the segment, (3,) [rad/time].
        slip: A fluid slips along it; False: a viscous one sticks to it.
        motion: A ``Trajectory`` or ``Keyframes`` in the place of both velocities.

    Raises:
        ValueError: Values out of range; ends that coincide; a periodic scene.

    Example:
        >>> log = CapsuleBoundary((-1, 0, 0), (1, 0, 0), 0.25, friction=0.4)
        >>> log.distance([(0, 1, 0), (3, 0, 0)]).tolist()
        [0.75, 1.75]
    """

    def __init__(
        self, start: Sequence[float], end: Sequence[float], radius: float, inside: bool = False,
        friction: float = 0.0, restitution: float = 0.0, group: Any = None, *,
        velocity: Sequence[float] = STILL, angular_velocity: Sequence[float] = STILL,
        slip: bool = True, motion: Motion | None = None,
    ):  # fmt: skip
        self._holds(friction, restitution, group, velocity, angular_velocity, slip, motion)
        self._round(start, end, radius, inside)

    def near(self, precision: Precision, params: Any) -> wp.Function:
        return kernels.capsule_near(precision, params)

    def shapes(self) -> list[dict[str, Any]]:
        angle = np.linspace(0.0, 0.5 * np.pi, 13)
        r, z = np.sin(angle) * self.radius, np.cos(angle) * self.radius + self.half
        cap = np.stack([r, -z], axis=1)
        return self._drawn(np.concatenate([cap, cap[::-1] * [1, -1]]))


class CylinderBoundary(RoundBoundary):
    """The inside of a cylinder with flat ends, or its outside.

    From the outside, what crosses its middle in one substep leaves on the other side. Turning about
    its axis it is a drum, which stays where it is.

    Args:
        start: Middle of one end [length], (3,).
        end: Middle of the other [length], (3,).
        radius: Distance of the surface from the axis [length], above 0.
        inside: True: a container; False: an obstacle.
        friction: mu of all sides, at least 0.
        restitution: e, 0 to 1: speed after over speed before, both against the surface's.
        group: Which particles it holds; None: all.
        capped: It ends where it says; False: it goes on along its axis without end, and is drawn
            from ``start`` to ``end``.
        velocity: Of the cylinder, (3,) [length/time].
        angular_velocity: About the middle of its axis, (3,) [rad/time].
        slip: A fluid slips along it; False: a viscous one sticks to it.
        motion: A ``Trajectory`` or ``Keyframes`` in the place of both velocities.

    Raises:
        ValueError: Values out of range; ends that coincide; a periodic scene, but for one that is
            periodic along the axis of a cylinder without ends.

    Example:
        >>> drum = CylinderBoundary(
        ...     (0, 0, -1), (0, 0, 1), 0.5, inside=True, friction=0.6, angular_velocity=(0, 0, 2))
        >>> drum.distance([(0, 0, 0), (0.25, 0, 0), (0, 0, 0.75)]).tolist()
        [0.5, 0.25, 0.25]
    """

    sides = 3

    def __init__(
        self, start: Sequence[float], end: Sequence[float], radius: float, inside: bool = False,
        friction: float = 0.0, restitution: float = 0.0, group: Any = None, *,
        capped: bool = True, velocity: Sequence[float] = STILL,
        angular_velocity: Sequence[float] = STILL, slip: bool = True, motion: Motion | None = None,
    ):  # fmt: skip
        self._holds(friction, restitution, group, velocity, angular_velocity, slip, motion)
        self._round(start, end, radius, inside)
        self.capped = bool(capped)
        if self.inside and self.capped:
            self.places = (0, 1, 1)

    def kind(self) -> tuple[Any, ...]:
        return (*super().kind(), self.places)

    def near(self, precision: Precision, params: Any) -> wp.Function:
        return kernels.cylinder_near(precision, params)

    def facing(self, precision: Precision, params: Any) -> wp.Function:
        if len(self.places) > 1:  # of a fluid in a corner both count
            return kernels.cylinder_facing(precision, params)
        return super().facing(precision, params)

    def _geometry(self, device: Any, precision: Precision) -> dict[str, Any]:
        half = self.half if self.capped else np.inf
        return {**super()._geometry(device, precision), "half": half}

    def _room(self) -> float:
        return min(self.radius, self.half) if self.capped else self.radius

    def _carried(self) -> tuple[np.ndarray, np.ndarray]:
        travel, turn = super()._carried()
        if not self.capped and not turn.any():  # along its axis it moves in itself
            travel = travel - self.axis * (travel @ self.axis)
        return travel, turn

    def shapes(self) -> list[dict[str, Any]]:
        rim = [(self.radius, -self.half), (self.radius, self.half)]
        ends = [(0.0, -self.half), *rim, (0.0, self.half)]
        return self._drawn(np.array(ends if self.capped else rim))
