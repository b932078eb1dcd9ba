"""What particles are held off by their radius with: the engine's side of boundaries."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import warp as wp

from .. import validate
from ..engine.easing import Easing
from ..engine.execution.launch import call, launch
from ..engine.model import Model
from ..engine.neighbors.lists import Neighbors
from ..engine.state import State
from ..kernels.constraints import boundary as kernels
from ..kernels.constraints.boundaries.bounce import bounce_kernel, start_bounce_kernel
from ..kernels.constraints.boundaries.meeting import Form, held_type
from ..kernels.constraints.boundaries.paths import SHORT
from ..kernels.constraints.rigid_motion import motion_type, pose_kernel, pose_type
from ..kernels.parameters import by_name, numbers
from ..kernels.precision import Precision
from ..scene.wall import Wall
from .easing import EasedConstraint
from .tuples import bodies


class Holding(EasedConstraint):
    """Base of :class:`~particlesim.constraints.boundary.Boundary`, which describes what holds."""

    requires = frozenset({"position", "velocity", "inverse_mass", "radius", "correction"})
    rank = 2
    solid = True
    sides = 1  # at most how many of them a particle touches at once
    tracked = False  # its surface looks at the way of a substep
    mixed = False  # its parts have frictions and restitutions of their own
    slip: bool
    places: tuple[int, ...] = (0,)  # see Wall

    def surface(self, precision: Precision) -> wp.Function:
        """Where it is, as a Warp function (see kernels.constraints.boundary_shapes)."""
        raise NotImplementedError

    def facing(self, precision: Precision, params: Any) -> wp.Function:
        """How far its sides are, as a Warp function (see kernels.constraints.walls)."""
        raise NotImplementedError

    def touch(self, precision: Precision, params: Any) -> wp.Function:
        """Friction and restitution there (see kernels.constraints.boundaries.combined)."""
        raise NotImplementedError

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        self.model = model
        for w, peer in enumerate(self.peers):
            peer._check(model, w)
            if peer.motion is not None and any(model.periodic):
                raise validate.fail(
                    self.name, "motion", "be None in a periodic scene", peer.motion, "leave it out"
                )
        members = model.members([peer.group for peer in self.peers], self.name)
        self.count, self.members = len(members), members
        self.held = held_type(model.precision, self.sides)()
        self.held.particle = model.array(members, wp.int32)
        self.worlds_held = model.world_of[members]
        self.held.world = model.array(self.worlds_held, wp.int32)
        columns = self._columns(model, ["friction", "restitution"])
        # Rigid bodies are hit by impulses, whether they bounce or not.
        rigid = [any(c.rigid_bodies for c in scene.constraints) for scene in model.scenes]
        columns["by_impulse"] = np.array(columns["restitution"]) + np.array(rigid, dtype=float)
        model.fits(self.name, numbers(columns))
        radii = model.column("radius")[members]
        model.squares_fit(self.name, "radius", np.concatenate([radii, model.apart()[0]]))
        self.Params, self.params = model.parameters(f"{type(self).__name__}Parameters", columns)
        self.rough, self.bouncing = any(columns["friction"]), columns["by_impulse"].any()
        self.moving = any(peer.moves for peer in self.peers)
        if self.moving:
            self.requires = self.requires | {"time"}

    def _columns(self, model: Model, names: Sequence[str]) -> dict[str, Any]:
        """What the surface takes, and these values of the boundary, in every world."""
        rows = [
            {
                **peer._geometry(model.device, model.precision),
                **{name: getattr(peer, name) for name in names},
            }
            for peer in self.peers
        ]
        return by_name(rows)

    def wall(self, model: Model, state: State) -> Wall:
        """What it is to a continuum."""
        name, precision = type(self).__name__, model.precision
        Params, params = model.parameters(f"{name}Wall", self._columns(model, ["friction"]))
        pose, follow = self._posed(model, state)
        facing = self.facing(precision, Params)
        own = self.name, self.peers, self.places, not self.slip
        return Wall(*own, facing, Params, params, pose, follow)

    def attach(self, model: Model, state: State) -> None:
        if not self.count:
            return
        device, precision = model.device, model.precision
        each = precision.vector(self.sides)
        self.bodies = bodies(model, state)
        self.easing = Easing(model, self.count, each, ends=1)
        self.held.radius = state.radius
        self.held.slack, self.held.marked = self.easing.slack, self.easing.marked
        self.held.pressed = wp.zeros(self.count, dtype=precision.vec3, device=device)
        if self.tracked:
            count = model.particle_count
            self.held.start = wp.zeros(count, dtype=precision.vec3, device=device)
        if self.rough:
            self.held.grip = wp.zeros(self.count, dtype=each, device=device)
        self.held.pose, self.follow = self._posed(model, state)
        forces = "force" in state
        self.force = state.force if forces else wp.empty(0, dtype=precision.vec3, device=device)
        self.form = Form(
            self.surface(precision), self.sides, precision, self.Params, "position_error" in state,
            self.moving, self.tracked, self.touch(precision, self.Params) if self.mixed else None,
        )  # fmt: skip
        self.begin_kernel = kernels.begin_kernel(self.form)
        self.project_kernel = kernels.project_kernel(self.form)
        if self.bouncing:
            self.held.came = wp.zeros(self.count, dtype=each, device=device)
            self.held.impulse = wp.zeros(self.count, dtype=each, device=device)
            self.start_bounce_kernel = start_bounce_kernel(self.form, forces)
            self.bounce_kernel = bounce_kernel(self.form)

    def _posed(self, model: Model, state: State) -> tuple[wp.array, Callable[[], None]]:
        """Where it is, one a world, and what brings that to the present; empty where it stays."""
        moving = any(peer.moves for peer in self.peers)
        count, precision = model.world_count if moving else 0, model.precision
        pose = wp.zeros(count, dtype=pose_type(precision), device=model.device)
        if not moving:
            return pose, lambda: None
        if self.peers[0].motion is not None:
            return pose, self._following(model, state, pose)
        carried = [peer._carried() for peer in self.peers]
        columns = {
            "velocity": [peer.velocity for peer in self.peers],
            "spin": [peer.angular_velocity for peer in self.peers],
            "travel": [travel for travel, _ in carried],
            "turn": [turn for _, turn in carried],
            "pivot": [peer._pivot() for peer in self.peers],
        }
        motion = model.structures(
            motion_type(), {name: np.array(rows) for name, rows in columns.items()}
        )
        inputs = [motion, state.time, pose]
        return pose, lambda: launch(pose_kernel(precision), count, inputs, model.device)

    def _following(self, model: Model, state: State, pose: wp.array) -> Callable[[], None]:
        """What brings the poses to where a motion of its own leads."""
        instant = model.settings.dt * SHORT
        given = [peer.motion.struct(model.device, peer._pivot(), instant) for peer in self.peers]
        Params = given[0][0]
        motions = model.structures(Params, by_name([values for _, values in given]))
        kernel = self.peers[0].motion.kernel(model.precision, Params)
        inputs = [motions, state.time, pose]
        return lambda: launch(kernel, len(pose), inputs, model.device)

    def complaint(self) -> str:
        """That places are too coarse for the radii."""
        return self.model.unresolved_radii(self.name, self.members)

    def worlds(self, name: str, array: wp.array) -> np.ndarray | None:
        return self.worlds_held if name in ("slack", "pressed") else super().worlds(name, array)

    def readable(self) -> dict[str, wp.array]:
        return {"pressed": self.held.pressed} if self.count else {}

    def _launch(self, kernel: wp.Kernel, *inputs: Any) -> None:
        everything = [self.params, self.held, self.bodies, *inputs]
        launch(kernel, self.count, everything, self.model.device)

    def begin(self, state: State, neighbors: Neighbors, dt: float) -> None:
        if not self.count or dt <= 0:
            return
        # The clock goes with the positions: this is where the substep ends.
        self.follow()
        # A static projection goes by the radii as they are, and leaves the marks to the first step.
        if dt < math.inf:
            self._launch(self.begin_kernel, self.easing.struct, dt)
            call(self.easing.unmark)
        elif self.tracked:
            self._launch(kernels.track_kernel(self.form))

    def project(self, state: State, neighbors: Neighbors, dt: float) -> None:
        if self.count and dt > 0:
            timed = dt < math.inf
            self._launch(self.project_kernel, float(timed), dt if timed else 0.0)

    @property
    def bounces(self) -> bool:
        return bool(self.count) and bool(self.bouncing)

    def start_bounce(self, state: State, neighbors: Neighbors, bounces: Any, dt: float) -> None:
        if self.bounces:
            self._launch(self.start_bounce_kernel, self.force, bounces, dt, 1.0 / dt)

    def bounce(self, state: State, neighbors: Neighbors, bounces: Any, dt: float) -> None:
        if self.bounces:
            self._launch(self.bounce_kernel, bounces, dt, 1.0 / dt)

    def exerted(self) -> tuple[np.ndarray, np.ndarray]:
        """What particles exert that touch it, -m dx / dt^2 of the last substep, by row, (k, 3)."""
        if not self.count:
            return self.members, np.zeros((0, 3))
        mass = self.model.column("mass")[self.members]
        way = self.held.pressed.numpy().astype(np.float64)
        return self.members, -way * mass[:, None] / self.model.settings.substep**2
