"""What all boundaries share: particles held off by their radius, friction, bounces, motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from .. import validate
from ..engine.execution.launch import call, launch
from ..engine.model import Model
from ..engine.neighbors.lists import Neighbors
from ..engine.state import State
from ..kernels.constraints import boundary as kernels
from ..kernels.constraints.rigid_motion import motion_type, pose_kernel, pose_type
from ..kernels.precision import Precision
from .easing import EasedConstraint, Easing
from .tuples import bodies

STILL = (0.0, 0.0, 0.0)


class Boundary(EasedConstraint):
    """Base of boundaries: a member is its shape, the attributes that make it, and its pivot.

    Particles are held off by their radius, C >= 0 with nothing to soften it. Friction takes back
    the tangential way of the substep against the surface, up to mu times the normal correction
    (Macklin et al. 2014, eq. 24); restitution sets the normal velocity against the surface's after
    the solve (Mueller et al. 2020, eq. 34). What starts outside is brought in at no more than
    ``Settings.depenetration_speed``.

    A boundary moves as a rigid body from where it is described, by its world's clock: place and
    turn at time t are exact, however many substeps led there.
    """

    requires = frozenset({"position", "velocity", "inverse_mass", "radius", "correction"})
    sides = 1  # at most how many of them a particle touches at once
    geometry: tuple[str, ...]  # attributes that go into the kernels' parameters

    def __init__(
        self,
        friction: float,
        restitution: float,
        group: Any,
        velocity: Sequence[float],
        angular_velocity: Sequence[float],
    ):
        self.group = group
        self.friction = validate.number(self.name, "friction", friction, minimum=0.0)
        self.restitution = validate.number(
            self.name, "restitution", restitution, minimum=0.0, maximum=1.0
        )
        self.velocity = validate.vector(self.name, "velocity", velocity, unit="length/time")
        self.angular_velocity = validate.vector(
            self.name, "angular_velocity", angular_velocity, unit="rad/time"
        )

    @property
    def moves(self) -> bool:
        """Its surface has a velocity."""
        return bool(self.velocity.any() or self.angular_velocity.any())

    def pose(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Where it is: what is at x as described is at R x + T at ``time``.

        Args:
            time: Of its world, since the start [time].

        Returns:
            T, (3,) [length], and R, (3, 3). What moves the shape in itself, as a plane along
            itself or a sphere about its center, is left out.
        """
        travel, turn = self._carried()
        angle = float(np.linalg.norm(turn)) * time
        rotation = np.eye(3)
        if angle != 0.0:
            cross = np.cross(np.eye(3), turn / np.linalg.norm(turn))
            rotation += np.sin(angle) * cross + 2 * np.sin(angle / 2) ** 2 * cross @ cross
        pivot = self._pivot()
        return travel * time + pivot - rotation @ pivot, rotation

    def _drawn(self, kind: str, **parameters: Any) -> dict[str, Any]:
        """The shape for recordings, which ask a moving one for its pose."""
        moving = any(each.any() for each in self._carried())
        return {"kind": kind, "moving": moving, **parameters}

    def _pivot(self) -> np.ndarray:
        """What it turns about, as described."""
        raise NotImplementedError

    def _carried(self) -> tuple[np.ndarray, np.ndarray]:
        """Velocity and angular velocity, less what moves the shape in itself."""
        return self.velocity, self.angular_velocity

    def _check(self, model: Model, w: int) -> None:
        """The shape is fit for world w."""

    def surface(self, precision: Precision) -> wp.Function:
        """Where it is, as a Warp function (see kernels.constraints.boundary_shapes)."""
        raise NotImplementedError

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        self.model = model
        for w, peer in enumerate(self.peers):
            peer._check(model, w)
        members = model.members([peer.group for peer in self.peers], self.name)
        self.count = len(members)
        self.held = kernels.held_type(model.precision, self.sides)()
        self.held.particle = model.array(members, wp.int32)
        self.worlds_held = model.world_of[members]
        self.held.world = model.array(self.worlds_held, wp.int32)
        names = (*self.geometry, "friction", "restitution")
        columns = {name: self._column(name) for name in names}
        self.Params, self.params = model.parameters(f"{type(self).__name__}Parameters", columns)
        self.rough, self.bouncing = (bool(columns[name].any()) for name in names[-2:])
        self.moving = any(peer.moves for peer in self.peers)
        if self.moving:
            self.requires = self.requires | {"time"}

    def _column(self, name: str) -> np.ndarray:
        """An attribute of all worlds; what is true or false as whole numbers."""
        values = np.array([getattr(peer, name) for peer in self.peers])
        return values.astype(np.int32) if values.dtype == bool else values

    def attach(self, model: Model, state: State) -> None:
        if not self.count:
            return
        device, precision = model.device, model.precision
        each = precision.vector(self.sides)
        self.bodies = bodies(model, state)
        self.easing = Easing(model, self.count, each, ends=1)
        self.held.radius = state.radius
        self.held.slack, self.held.marked = self.easing.slack, self.easing.marked
        if self.rough:
            self.held.grip = wp.zeros(self.count, dtype=each, device=device)
        if self.moving:
            self._attach_motion(state)
        forces = "force" in state
        self.force = state.force if forces else wp.empty(0, dtype=precision.vec3, device=device)
        self.form = kernels.Form(
            self.surface(precision), self.sides, precision, self.Params, "position_error" in state,
            self.moving,
        )  # fmt: skip
        self.begin_kernel = kernels.begin_kernel(self.form)
        self.project_kernel = kernels.project_kernel(self.form)
        self.bounce_kernel = kernels.bounce_kernel(self.form, forces)

    def _attach_motion(self, state: State) -> None:
        """The motions of all worlds, and room for where they have led."""
        model = self.model
        carried = [peer._carried() for peer in self.peers]
        columns = {
            "velocity": [peer.velocity for peer in self.peers],
            "spin": [peer.angular_velocity for peer in self.peers],
            "travel": [travel for travel, _ in carried],
            "turn": [turn for _, turn in carried],
            "pivot": [peer._pivot() for peer in self.peers],
        }
        self.motion = model.structures(
            motion_type(), {name: np.array(rows) for name, rows in columns.items()}
        )
        self.clock = state.time
        self.held.pose = wp.zeros(
            model.world_count, dtype=pose_type(model.precision), device=model.device
        )

    def worlds(self, name: str, array: wp.array) -> np.ndarray | None:
        return self.worlds_held if name == "slack" else super().worlds(name, array)

    def _launch(self, kernel: wp.Kernel, *inputs: Any) -> None:
        everything = [self.params, self.held, self.bodies, *inputs]
        launch(kernel, self.count, everything, self.model.device)

    def begin(self, state: State, neighbors: Neighbors, dt: float) -> None:
        if not self.count or dt <= 0:
            return
        if self.moving:
            # The clock goes with the positions: this is where the substep ends.
            model = self.model
            inputs = [self.motion, self.clock, self.held.pose]
            launch(pose_kernel(model.precision), model.world_count, inputs, model.device)
        # A static projection goes by the radii as they are, and leaves the marks to the first step.
        if dt < math.inf:
            self._launch(self.begin_kernel, self.easing.struct, dt)
            call(self.easing.unmark)

    def project(self, state: State, neighbors: Neighbors, dt: float) -> None:
        if self.count and dt > 0:
            timed = dt < math.inf
            self._launch(self.project_kernel, float(timed), dt if timed else 0.0)

    def finish(self, state: State, neighbors: Neighbors, dt: float) -> None:
        if self.count and self.bouncing and dt > 0:
            self._launch(self.bounce_kernel, self.force, dt, 1.0 / dt)
