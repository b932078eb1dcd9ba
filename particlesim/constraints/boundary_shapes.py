"""Boundaries that hold particles off by their radius: planes, boxes and spheres."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from .. import validate
from ..engine.limit import Limit
from ..engine.model import Model
from ..engine.probe import Probe
from ..kernels.constraints import boundary_shapes as kernels
from ..kernels.constraints import walls
from ..kernels.constraints.boundaries import ready
from ..kernels.precision import Precision
from ..scene.law import law
from .boundaries.motion import Motion
from .boundaries.solid import STILL
from .boundary import Boundary
from .limits import crossing_limits


@law
def _half_space(x: wp.vec3, point: wp.vec3, normal: wp.vec3):
    return wp.dot(x - point, normal)


class PlaneBoundary(Boundary):
    """The half space (x - point) . n >= R, on the side that the normal points to.

    Args:
        point: A point of the plane [length], (3,); it turns about this one.
        normal: n, into the half space that is open to particles, (3,); any length but 0.
        friction: mu, at least 0.
        restitution: e, 0 to 1: speed after over speed before, both against the plane's.
        group: Which particles it holds; None: all.
        velocity: Of the plane, (3,) [length/time]: along the normal a piston, across it a
            conveyor belt, which stays where it is.
        angular_velocity: About the point, (3,) [rad/time]: along the normal a turntable.
        slip: A fluid slips along it; False: a viscous one sticks to it.
        motion: A ``Trajectory`` or ``Keyframes`` in the place of both velocities.

    Raises:
        ValueError: Values out of range; a normal along a periodic axis.

    Example:
        >>> ground = PlaneBoundary((0, 0, 0), (0, 2, 0), friction=0.5)
        >>> ground.normal.tolist()
        [0.0, 1.0, 0.0]
        >>> piston = PlaneBoundary((0, 0, 0), (0, 1, 0), velocity=(0, 0.5, 0))
        >>> piston.pose(time=2.0)[0].tolist()
        [0.0, 1.0, 0.0]
    """

    law = _half_space

    def __init__(
        self, point: Sequence[float], normal: Sequence[float], friction: float = 0.0,
        restitution: float = 0.0, group: Any = None, *, velocity: Sequence[float] = STILL,
        angular_velocity: Sequence[float] = STILL, slip: bool = True, motion: Motion | None = None,
    ):  # fmt: skip
        self._holds(friction, restitution, group, velocity, angular_velocity, slip, motion)
        self.point = validate.vector(self.name, "point", point, unit="length")
        given = validate.vector(self.name, "normal", normal)
        longest = np.abs(given).max()
        if not longest > 0:
            raise validate.fail(
                self.name, "normal", "have a direction", given, "point it to where particles are"
            )
        scaled = given / longest  # so that squares neither overflow nor vanish
        self.normal = scaled / np.linalg.norm(scaled)

    def surface(self, precision: Precision) -> wp.Function:
        return kernels.plane_function(precision, self.Params)

    def facing(self, precision: Precision, params: Any) -> wp.Function:
        return walls.plane_facing(precision, params)

    def near(self, precision: Precision, params: Any) -> wp.Function:
        return ready.plane_near(precision, params)

    def _geometry(self, device: Any, precision: Precision) -> dict[str, Any]:
        return {"point": self.point, "normal": self.normal}

    def shapes(self) -> list[dict[str, Any]]:
        return [self._shape("plane", point=self.point, normal=self.normal)]

    def _pivot(self) -> np.ndarray:
        return self.point

    def _carried(self) -> tuple[np.ndarray, np.ndarray]:
        n = self.normal
        if np.cross(n, self.angular_velocity).any():
            return self.velocity, self.angular_velocity
        return n * (n @ self.velocity), np.zeros(3)

    def _check(self, model: Model, w: int) -> None:
        turn = self._carried()[1]
        aside = np.cross(turn, self.normal)
        swept = np.array([self.normal, aside, np.cross(turn, aside)])  # the normals that it takes
        if swept[:, list(model.periodic)].any():
            raise validate.fail(
                self.name, "normal", "be along the open axes of a periodic scene", self.normal,
                "leave that axis open",
            )  # fmt: skip


@law
def _room(x: wp.vec3, lower: wp.vec3, upper: wp.vec3):
    a, b = x - lower, upper - x
    return wp.min(wp.min(wp.min(a[0], b[0]), wp.min(a[1], b[1])), wp.min(a[2], b[2]))


class BoxBoundary(Boundary):
    """The inside of a box: lower + R <= x <= upper - R on each axis.

    Args:
        lower: Lower corner [length], (3,); -inf leaves a side open.
        upper: Upper corner [length], (3,), above the lower; inf leaves a side open.
        friction: mu of all sides, at least 0.
        restitution: e, 0 to 1: speed after over speed before, both against the side's.
        group: Which particles it holds; None: all.
        velocity: Of the box, (3,) [length/time].
        angular_velocity: About its middle, (3,) [rad/time]; only of a box without open sides.
        slip: A fluid slips along it; False: a viscous one sticks to it.
        motion: A ``Trajectory`` or ``Keyframes`` in the place of both velocities.

    Raises:
        ValueError: Values out of range; a side on a periodic axis; an open box that turns.

    Example:
        >>> pool = BoxBoundary((0, 0, 0), (4, float("inf"), 1))
        >>> pool.upper.tolist()
        [4.0, inf, 1.0]
        >>> mill = BoxBoundary((-1, -1, -1), (1, 1, 1), friction=0.5, angular_velocity=(0, 0, 2))
        >>> mill.pose(time=np.pi / 4)[1].round(6).tolist()
        [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    """

    law = _room
    sides = 3
    places = (0, 0, 1, 1, 2, 2)

    def __init__(
        self, lower: Sequence[float], upper: Sequence[float], friction: float = 0.0,
        restitution: float = 0.0, group: Any = None, *, velocity: Sequence[float] = STILL,
        angular_velocity: Sequence[float] = STILL, slip: bool = True, motion: Motion | None = None,
    ):  # fmt: skip
        self._holds(friction, restitution, group, velocity, angular_velocity, slip, motion)
        self.lower = self._corner("lower", lower, -np.inf)
        self.upper = self._corner("upper", upper, np.inf)
        if not (self.lower < self.upper).all():
            raise validate.fail(
                self.name, "upper", f"be above lower {self.lower.tolist()} [length]", self.upper,
                "swap the corners",
            )  # fmt: skip
        closed = np.isfinite(self.lower) & np.isfinite(self.upper)
        if self.angular_velocity.any() and not closed.all():
            raise validate.fail(
                self.name, "angular_velocity", "be 0 where sides are open, as there is no middle",
                self.angular_velocity, "close the box, or turn planes",
            )  # fmt: skip

    def _corner(self, name: str, value: Any, open_side: float) -> np.ndarray:
        sides = np.asarray(value, dtype=np.float64) if np.shape(value) == (3,) else None
        opened = np.zeros(3, dtype=bool) if sides is None else sides == open_side
        # The open sides are the only values that may be infinite.
        finite = value if sides is None else np.where(opened, 0.0, sides)
        corner = validate.vector(self.name, name, finite, unit="length")
        return np.where(opened, open_side, corner)

    def surface(self, precision: Precision) -> wp.Function:
        return kernels.box_function(precision, self.Params)

    def facing(self, precision: Precision, params: Any) -> wp.Function:
        return walls.box_facing(precision, params)

    def near(self, precision: Precision, params: Any) -> wp.Function:
        return ready.box_near(precision, params)

    def _geometry(self, device: Any, precision: Precision) -> dict[str, Any]:
        return {"lower": self.lower, "upper": self.upper}

    def shapes(self) -> list[dict[str, Any]]:
        return [self._shape("box", lower=self.lower, upper=self.upper)]

    def limits(self, probe: Probe) -> list[Limit]:
        """|v| dt <= upper - lower along each axis; half spaces are never passed through."""
        names = [f"width / v along {axis}" for axis in "xyz"]
        return crossing_limits(self, probe, names, lambda box, v: (box.upper - box.lower) / abs(v))

    def width(self) -> float:
        return float((self.upper - self.lower).min())

    def _pivot(self) -> np.ndarray:
        closed = np.isfinite(self.lower).all() and np.isfinite(self.upper).all()
        return 0.5 * self.lower + 0.5 * self.upper if closed else np.zeros(3)

    def _carried(self) -> tuple[np.ndarray, np.ndarray]:
        # Along an axis without sides it moves in itself.
        sided = np.isfinite(self.lower) | np.isfinite(self.upper)
        return np.where(sided, self.velocity, 0.0), self.angular_velocity

    def _check(self, model: Model, w: int) -> None:
        for axis, on in enumerate(model.periodic):
            if on and (np.isfinite(self.lower[axis]) or np.isfinite(self.upper[axis])):
                raise validate.fail(
                    self.name, f"sides along {'xyz'[axis]}", "be open where the scene is periodic",
                    [float(self.lower[axis]), float(self.upper[axis])], "use -inf and inf",
                )  # fmt: skip


@law
def _ball(x: wp.vec3, center: wp.vec3, radius: float, inside: int):
    d = wp.length(x - center) - radius
    return wp.where(inside != 0, -d, d)


class SphereBoundary(Boundary):
    """The inside of a sphere, |x - center| <= radius - R, or its outside, >= radius + R.

    From the outside, what crosses the middle of the sphere in one substep leaves on the other side.

    Args:
        center: Middle of the sphere [length], (3,).
        radius: Of the sphere [length], above 0.
        inside: True: a container; False: an obstacle.
        friction: mu, at least 0.
        restitution: e, 0 to 1: speed after over speed before, both against the surface's.
        group: Which particles it holds; None: all.
        velocity: Of the sphere, (3,) [length/time].
        angular_velocity: About the center, (3,) [rad/time].
        slip: A fluid slips along it; False: a viscous one sticks to it.
        motion: A ``Trajectory`` or ``Keyframes`` in the place of both velocities.

    Raises:
        ValueError: Values out of range; a periodic scene.

    Example:
        >>> bowl = SphereBoundary((0, 1, 0), 1.0, friction=0.1)
        >>> ball = SphereBoundary((0, 0, 0), 0.2, inside=False, velocity=(1, 0, 0))
        >>> ball.pose(time=3.0)[0].tolist()
        [3.0, 0.0, 0.0]
    """

    law = _ball

    def __init__(
        self, center: Sequence[float], radius: float, inside: bool = True, friction: float = 0.0,
        restitution: float = 0.0, group: Any = None, *, velocity: Sequence[float] = STILL,
        angular_velocity: Sequence[float] = STILL, slip: bool = True, motion: Motion | None = None,
    ):  # fmt: skip
        self._holds(friction, restitution, group, velocity, angular_velocity, slip, motion)
        self.center = validate.vector(self.name, "center", center, unit="length")
        self.radius = validate.number(self.name, "radius", radius, above=0.0, unit="length")
        self.inside = bool(inside)

    def surface(self, precision: Precision) -> wp.Function:
        return kernels.sphere_function(precision, self.Params)

    def facing(self, precision: Precision, params: Any) -> wp.Function:
        return walls.sphere_facing(precision, params)

    def near(self, precision: Precision, params: Any) -> wp.Function:
        return ready.sphere_near(precision, params)

    def _geometry(self, device: Any, precision: Precision) -> dict[str, Any]:
        return {"center": self.center, "radius": self.radius, "inside": int(self.inside)}

    def shapes(self) -> list[dict[str, Any]]:
        ball = {"center": self.center, "radius": self.radius, "container": self.inside}
        return [self._shape("sphere", **ball)]

    def limits(self, probe: Probe) -> list[Limit]:
        """|v| dt <= radius: to cross a container, or to pass the middle of an obstacle."""
        return crossing_limits(
            self, probe, ["radius / v"],
            lambda ball, v: ball.radius / np.linalg.norm(v, axis=1, keepdims=True),
        )  # fmt: skip

    def width(self) -> float:
        return self.radius

    def _pivot(self) -> np.ndarray:
        return self.center

    def _carried(self) -> tuple[np.ndarray, np.ndarray]:
        return self.velocity, np.zeros(3)

    def _check(self, model: Model, w: int) -> None:
        if any(model.periodic):
            raise validate.fail(
                self.name, "scene", "be open along all axes", list(model.periodic),
                "leave periodic out",
            )  # fmt: skip
