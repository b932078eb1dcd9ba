"""Boundaries: what holds particles off by their radius, from one law, its signed distance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from .. import validate
from ..engine.model import Model
from ..interactions.laws.arguments import Arguments
from ..kernels.constraints import boundary_shapes as kernels
from ..kernels.constraints import walls
from ..kernels.precision import FLOAT64, Precision, structure
from ..scene.law import Law
from ..scene.law import law as make_law
from .boundaries.drawing import level_set, nodes
from .boundaries.motion import Motion
from .holding import Holding

STILL = (0.0, 0.0, 0.0)
PLACES = 4096  # at which a law is asked for its period
# Arguments of every boundary.
OWN = frozenset(
    {
        "law",
        "friction",
        "restitution",
        "group",
        "velocity",
        "angular_velocity",
        "pivot",
        "drawn",
        "slip",
        "motion",
    }
)


class Boundary(Holding):
    """What holds particles off by their radius, d(x) >= R, from one law: its signed distance d.

    Particles are held with nothing to soften it. Friction takes back the tangential way of the
    substep against the surface, up to mu times the normal correction (Macklin et al. 2014, eq. 24);
    restitution sets the normal velocity against the surface's after the solve (Mueller et al. 2020,
    eq. 34). What starts outside is brought in at no more than ``Settings.depenetration_speed``.

    The normal is the law's gradient, derived. Where that has another length than 1, the law is no
    distance, and the way along its gradient to where it is 0 counts: d / |grad d| to first order.
    On a place without a gradient, as the axis of a cylinder, that of a place next to it does. What
    goes through in one substep is not seen.

    A boundary moves as a rigid body from where it is described, by its world's clock: place and
    turn at time t are exact, however many substeps led there. Its velocities are given, or follow
    from a ``motion``, a path or poses at times.

    ``PlaneBoundary``, ``BoxBoundary`` and ``SphereBoundary`` are boundaries whose surface is
    written out, so that they are exact where rounding or a lack of room would tell.

    Args:
        law: ``d(x, ...)`` [length], positive where particles may be: the first parameter is the
            place, ``wp.vec3``, the others are given by keyword.
        friction: mu, at least 0.
        restitution: e, 0 to 1: speed after over speed before, both against the surface's.
        group: Which particles it holds; None: all.
        velocity: Of the boundary, (3,) [length/time].
        angular_velocity: About the pivot, (3,) [rad/time].
        pivot: What it turns about, as described, (3,) [length].
        slip: A fluid slips along it; False: a viscous one sticks to it.
        motion: A ``Trajectory`` or ``Keyframes`` in the place of both velocities.
        drawn: ``(lower, upper)`` corners [length] of the box in which recordings draw the surface,
            as described; None: it is not drawn.
        **parameters: The law's further parameters: a number each, or (3,) where the law takes a
            ``wp.vec3``.

    Raises:
        ValueError: Values out of range; a law that takes no place or cannot be derived; a parameter
            that is missing; in a periodic scene a law of another period, or one that turns.
        TypeError: A parameter that the law does not have.

    Example:
        >>> @law
        ... def torus(x: wp.vec3, ring: float, tube: float):
        ...     return wp.length(wp.vec2(wp.length(wp.vec2(x[0], x[2])) - ring, x[1])) - tube
        >>> wheel = Boundary(torus, friction=0.3, angular_velocity=(1, 0, 0), ring=1.0, tube=0.2)
        >>> wheel.distance([(0, 0, 0), (1, 0.3, 0)]).round(6).tolist()
        [0.8, 0.1]
    """

    law: Law  # of the class, where that has a surface of its own

    def __init__(
        self, law: Any, friction: float = 0.0, restitution: float = 0.0, group: Any = None, *,
        velocity: Sequence[float] = STILL, angular_velocity: Sequence[float] = STILL,
        pivot: Sequence[float] = STILL, slip: bool = True, motion: Motion | None = None,
        drawn: tuple[Sequence[float], Sequence[float]] | None = None, **parameters: Any,
    ):  # fmt: skip
        self._holds(friction, restitution, group, velocity, angular_velocity, slip, motion)
        self.pivot = validate.vector(self.name, "pivot", pivot, unit="length")
        self.law = make_law(law)
        self.law.check_derivable(self.name)
        self.parameters = self._values(parameters)
        self._box = None if drawn is None else self._corners(drawn)

    def _holds(
        self, friction: float, restitution: float, group: Any, velocity: Sequence[float],
        angular_velocity: Sequence[float], slip: bool, motion: Motion | None,
    ) -> None:  # fmt: skip
        """What boundaries of every surface are made with."""
        self.group, self.slip, self.motion = group, bool(slip), motion
        self.friction = validate.number(self.name, "friction", friction, minimum=0.0)
        self.restitution = validate.number(
            self.name, "restitution", restitution, minimum=0.0, maximum=1.0
        )
        self.velocity = validate.vector(self.name, "velocity", velocity, unit="length/time")
        self.angular_velocity = validate.vector(
            self.name, "angular_velocity", angular_velocity, unit="rad/time"
        )
        if motion is not None and not isinstance(motion, Motion):
            raise validate.fail(
                self.name,
                "motion",
                "be a Trajectory or Keyframes",
                motion,
                "make one, or leave it out",
            )
        if motion is not None and (self.velocity.any() or self.angular_velocity.any()):
            raise validate.fail(
                self.name, "velocity", "be 0 with a motion, which has velocities of its own",
                [self.velocity.tolist(), self.angular_velocity.tolist()], "leave it out",
            )  # fmt: skip

    def _values(self, given: dict[str, Any]) -> dict[str, Any]:
        """The law's further parameters."""
        names = list(self.law.parameters)
        if not names or self.law.parameters[names[0]] is not wp.vec3:
            raise validate.fail(
                self.name, "law", "take a place (wp.vec3) first", self.law.name,
                "write def law(x: wp.vec3, ...)",
            )  # fmt: skip
        for name in OWN & {*names[1:]}:
            raise validate.fail(
                self.name, f"parameter {name} of {self.law.name}", "have a name of its own", name,
                "rename it",
            )  # fmt: skip
        values = Arguments(self.name, self.law, 1, given, ()).values
        for name, value in values.items():
            check = validate.vector if self.law.parameters[name] is wp.vec3 else validate.number
            check(self.name, name, value)
        return values

    def _corners(self, drawn: Any) -> tuple[np.ndarray, np.ndarray]:
        if not isinstance(drawn, Sequence | np.ndarray) or len(drawn) != 2:
            raise validate.fail(
                self.name, "drawn", "be two corners [length]", drawn, "give (lower, upper)"
            )
        lower, upper = (validate.vector(self.name, "drawn", each, unit="length") for each in drawn)
        if not (lower < upper).all():
            raise validate.fail(
                self.name, "drawn", f"have its upper corner above {lower.tolist()} [length]", upper,
                "swap the corners",
            )  # fmt: skip
        return lower, upper

    def kind(self) -> tuple[Any, ...]:
        given = (self.law.key, tuple(self.parameters)) if "law" in vars(self) else ()
        motion = () if self.motion is None else self.motion.kind()
        return (type(self), self.slip, *given, *motion)

    def distance(self, points: Any) -> np.ndarray:
        """The law at points (n, 3) [length] of the boundary as described, that is at time 0.

        Returns:
            (n,) [length], positive where particles may be.
        """
        x = validate.rows(f"{self.name}.distance", "points", points, None, 3)
        values = self._geometry("cpu", FLOAT64)
        kinds = {
            name: {wp.vec3: wp.vec3d, int: wp.int32}.get(self.law.parameters[name], wp.float64)
            for name in values
        }
        Params = structure("DistanceParameters", kinds)
        given = Params()
        for name, value in values.items():
            setattr(given, name, kinds[name](value))
        law = self.law.function(FLOAT64, self.name, float)
        kernel = kernels.distance_kernel(law, tuple(kinds), Params)
        found = wp.empty(len(x), dtype=wp.float64, device="cpu")
        places = wp.array(x, dtype=wp.vec3d, device="cpu")
        wp.launch(kernel, len(x), [given, places], [found], device="cpu")
        return found.numpy()

    @property
    def moves(self) -> bool:
        """Its surface has a velocity."""
        given = self.velocity.any() or self.angular_velocity.any()
        return self.motion is not None or bool(given)

    def drift(self, time: float) -> np.ndarray:
        """The velocity of its pivot at ``time``, (3,) [length/time]."""
        return self.velocity if self.motion is None else self.motion.at(time, self._pivot())[2]

    def pose(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Where it is: what is at x as described is at R x + T at ``time``.

        Args:
            time: Of its world, since the start [time].

        Returns:
            T, (3,) [length], and R, (3, 3). What moves the shape in itself, as a plane along
            itself or a sphere about its center, is left out.
        """
        if self.motion is not None:
            pivot = self._pivot()
            way, rotation, _ = self.motion.at(time, pivot)
            return way + pivot - rotation @ pivot, rotation
        travel, turn = self._carried()
        angle = float(np.linalg.norm(turn)) * time
        rotation = np.eye(3)
        if angle != 0.0:
            cross = np.cross(np.eye(3), turn / np.linalg.norm(turn))
            rotation += np.sin(angle) * cross + 2 * np.sin(angle / 2) ** 2 * cross @ cross
        pivot = self._pivot()
        return travel * time + pivot - rotation @ pivot, rotation

    def shapes(self) -> list[dict[str, Any]]:
        """Its surface in the box that is drawn, clear where it closes in the particles."""
        if self._box is None:
            return []
        places, counts = nodes(*self._box)
        mesh = level_set(self.distance(places).reshape(counts), *self._box)
        return [self._shape("mesh", **mesh)] if mesh else []

    def _shape(self, kind: str, **parameters: Any) -> dict[str, Any]:
        """A shape for recordings, which ask a moving one for its pose."""
        moving = self.motion is not None or any(each.any() for each in self._carried())
        return {"kind": kind, "moving": moving, **parameters}

    def _pivot(self) -> np.ndarray:
        """What it turns about, as described."""
        return self.pivot

    def _carried(self) -> tuple[np.ndarray, np.ndarray]:
        """Velocity and angular velocity, less what moves the shape in itself."""
        return self.velocity, self.angular_velocity

    def _geometry(self, device: Any, precision: Precision) -> dict[str, Any]:
        """What the surface takes, by name."""
        return self.parameters

    def _check(self, model: Model, w: int) -> None:
        """The shape is fit for world w: along a periodic axis, one period on it is the same."""
        axes = np.flatnonzero(model.periodic)
        if not len(axes) or not model.scenes[w].particle_count:
            return
        if self.angular_velocity.any():
            raise validate.fail(
                self.name, "angular_velocity", "be 0 in a periodic scene", self.angular_velocity,
                "leave it out",
            )  # fmt: skip
        x, length = model.scenes[w].position, model.box_length[w]
        lower = np.where(model.periodic, model.box_lower[w], x.min(axis=0) - length.max())
        upper = np.where(model.periodic, lower + length, x.max(axis=0) + length.max())
        points = np.random.default_rng(0).uniform(lower, upper, (PLACES, 3))
        d = self.distance(points)
        for axis in axes:
            gap = np.abs(self.distance(points + length * np.eye(3)[axis]) - d).max()
            if not gap <= 1e-6 * length[axis]:
                raise validate.fail(
                    self.name, f"law {self.law.name}" if hasattr(self, "law") else "surface",
                    f"be the same one period on, {length[axis]:g} along {'xyz'[axis]} [length]",
                    f"a difference of {gap:g}", "give it that period, or leave the axis open",
                )  # fmt: skip

    def surface(self, precision: Precision) -> wp.Function:
        """Where it is, as a Warp function (see kernels.constraints.boundary_shapes)."""
        law = self.law.function(precision, self.name, float)
        return kernels.distance_function(law, tuple(self.parameters), precision, self.Params)

    def facing(self, precision: Precision, params: Any) -> wp.Function:
        law = self.law.function(precision, self.name, float)
        return walls.distance_facing(law, tuple(self.parameters), precision, params)
