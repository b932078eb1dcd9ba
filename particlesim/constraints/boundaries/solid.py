"""Boundaries at large: what holds, how it moves, and where it is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine.model import Model
from ...kernels.constraints.boundaries.combined import own_touch
from ...kernels.precision import Precision
from ...scene.law import Law
from ..holding import Holding
from .motion import Motion

STILL = (0.0, 0.0, 0.0)
PLACES = 4096  # at which a surface is asked for its period


class SolidBoundary(Holding):
    """Base of all boundaries: rigid bodies that hold particles off by their radius.

    A member gives its surface (see :class:`~particlesim.constraints.holding.Holding`), what that
    takes, its signed distance and the shapes that are drawn.
    """

    law: Law  # of the class, where that has a surface of its own
    pivot: np.ndarray

    def kind(self) -> tuple[Any, ...]:
        motion = () if self.motion is None else self.motion.kind()
        return (type(self), self.slip, *motion)

    def distance(self, points: Any) -> np.ndarray:
        """The signed distance at points (n, 3) [length] of the boundary as described."""
        raise validate.undefined(self, "distance(self, points)")

    def near(self, precision: Precision, params: Any) -> wp.Function:
        """The nearest point, as a Warp function (see kernels.constraints.boundaries.nearest)."""
        raise validate.undefined(self, "near(self, precision, params)")

    def _geometry(self, device: Any, precision: Precision) -> dict[str, Any]:
        """What the surface takes, by name."""
        raise validate.undefined(self, "_geometry(self, device, precision)")

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

    def touch(self, precision: Precision, params: Any) -> wp.Function:
        """Friction and restitution there (see kernels.constraints.boundaries.combined)."""
        return own_touch(precision, params)

    def width(self) -> float:
        """How far a particle may go in a substep, so as not to pass it unseen [length]."""
        return np.inf
