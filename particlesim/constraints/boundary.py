"""Boundaries that particles stay inside of: planes and boxes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import warp as wp

from .. import validate
from ..kernels import boundary as kernels
from ..launch import call, launch
from .base import ConstraintBase
from .easing import Easing
from .tuples import bodies

if TYPE_CHECKING:
    from ..model import Model
    from ..neighbors import Neighbors
    from ..state import State


class Boundary(ConstraintBase):
    """Base of boundaries: a member is its geometry, its kernels and the type of their state.

    Particles are held off by their radius, C >= 0 with nothing to soften it. Friction takes back
    the tangential way of the substep, up to mu times the normal correction (Macklin et al. 2014,
    eq. 24); restitution sets the normal velocity after the solve (Mueller et al. 2020, eq. 34).
    What starts outside is brought in at no more than ``Settings.depenetration_speed``.
    """

    requires = frozenset({"position", "velocity", "inverse_mass", "radius", "correction"})
    geometry: tuple[str, ...]  # attributes that go into the kernels' parameters

    def __init__(self, friction: float, restitution: float, group: Any):
        self.group = group
        self.friction = validate.number(self.name, "friction", friction, minimum=0.0)
        self.restitution = validate.number(
            self.name, "restitution", restitution, minimum=0.0, maximum=1.0
        )

    def _kernels(self, *shape: Any) -> tuple[wp.Kernel, wp.Kernel, wp.Kernel]:
        """Start of a substep, projection, bounce."""
        raise NotImplementedError

    def _each(self, model: Model) -> Any:
        """Type of slack and grip: one number, or one an axis."""
        return model.precision.scalar

    def _check(self, model: Model, w: int) -> None:
        """The geometry is fit for world w."""

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        self.model = model
        for w, peer in enumerate(self.peers):
            peer._check(model, w)
        members = model.members([peer.group for peer in self.peers], self.name)
        self.count = len(members)
        self.held = kernels.held_type(model.precision, self._each(model))()
        self.held.particle = model.array(members, wp.int32)
        self.held.world = model.array(model.world_of[members], wp.int32)
        names = (*self.geometry, "friction", "restitution")
        columns = {name: np.array([getattr(peer, name) for peer in self.peers]) for name in names}
        self.Params, self.params = model.parameters(f"{type(self).__name__}Parameters", columns)
        self.rough, self.bouncing = (bool(columns[name].any()) for name in names[-2:])

    def attach(self, model: Model, state: State) -> None:
        if not self.count:
            return
        each, device = self._each(model), model.device
        self.bodies = bodies(model, state)
        self.easing = Easing(model, self.count, each, ends=1)
        self.held.radius = state.radius
        self.held.slack, self.held.marked = self.easing.slack, self.easing.marked
        if self.rough:
            self.held.grip = wp.zeros(self.count, dtype=each, device=device)
        forces = "force" in state
        vec3 = model.precision.vec3
        self.force = state.force if forces else wp.empty(0, dtype=vec3, device=device)
        self.start, self.push, self.bounce = self._kernels(
            model.precision, self.Params, "position_error" in state, forces
        )

    def _launch(self, kernel: wp.Kernel, *inputs: Any) -> None:
        everything = [self.params, self.held, self.bodies, *inputs]
        launch(kernel, self.count, everything, self.model.device)

    def begin(self, state: State, neighbors: Neighbors, dt: float) -> None:
        # A static projection goes by the radii as they are, and leaves the marks to the first step.
        if self.count and 0 < dt < math.inf:
            self._launch(self.start, self.easing.struct, dt)
            call(self.easing.unmark)

    def project(self, state: State, neighbors: Neighbors, dt: float) -> None:
        if self.count and dt > 0:
            moving = dt < math.inf
            self._launch(self.push, float(moving), dt if moving else 0.0)

    def finish(self, state: State, neighbors: Neighbors, dt: float) -> None:
        if self.count and self.bouncing and dt > 0:
            self._launch(self.bounce, self.force, dt, 1.0 / dt)

    def persistent(self) -> dict[str, wp.array]:
        return self.easing.persistent() if self.count else {}

    def reset(self, worlds: Sequence[int]) -> None:
        self.placed(worlds)

    def placed(self, worlds: Iterable[int]) -> None:
        if self.count:
            self.easing.mark(worlds)


class PlaneBoundary(Boundary):
    """The half space (x - point) . n >= R, on the side that the normal points to.

    Args:
        point: A point of the plane [length], (3,).
        normal: n, into the half space that is open to particles, (3,); any length but 0.
        friction: mu, at least 0.
        restitution: e, 0 to 1: speed after over speed before.
        group: Which particles it holds; None: all.

    Raises:
        ValueError: Values out of range; a normal along a periodic axis.

    Example:
        >>> ground = PlaneBoundary((0, 0, 0), (0, 2, 0), friction=0.5)
        >>> ground.normal.tolist()
        [0.0, 1.0, 0.0]
    """

    geometry = ("point", "normal")

    def __init__(
        self,
        point: Sequence[float],
        normal: Sequence[float],
        friction: float = 0.0,
        restitution: float = 0.0,
        group: Any = None,
    ):
        super().__init__(friction, restitution, group)
        self.point = validate.vector(self.name, "point", point, unit="length")
        given = validate.vector(self.name, "normal", normal)
        longest = np.abs(given).max()
        if not longest > 0:
            raise validate.fail(
                self.name, "normal", "have a direction", given, "point it to where particles are"
            )
        scaled = given / longest  # so that squares neither overflow nor vanish
        self.normal = scaled / np.linalg.norm(scaled)

    def shapes(self) -> list[dict[str, Any]]:
        return [{"kind": "plane", "point": self.point, "normal": self.normal}]

    def _kernels(self, *shape: Any) -> tuple[wp.Kernel, wp.Kernel, wp.Kernel]:
        return kernels.plane_kernels(*shape)

    def _check(self, model: Model, w: int) -> None:
        if any(on and n != 0 for on, n in zip(model.periodic, self.normal, strict=True)):
            raise validate.fail(
                self.name, "normal", "be along the open axes of a periodic scene", self.normal,
                "leave that axis open",
            )  # fmt: skip


class BoxBoundary(Boundary):
    """The inside of a box: lower + R <= x <= upper - R on each axis.

    Args:
        lower: Lower corner [length], (3,); -inf leaves a side open.
        upper: Upper corner [length], (3,), above the lower; inf leaves a side open.
        friction: mu of all sides, at least 0.
        restitution: e, 0 to 1: speed after over speed before.
        group: Which particles it holds; None: all.

    Raises:
        ValueError: Values out of range; a side on a periodic axis.

    Example:
        >>> pool = BoxBoundary((0, 0, 0), (4, float("inf"), 1))
        >>> pool.upper.tolist()
        [4.0, inf, 1.0]
    """

    geometry = ("lower", "upper")

    def __init__(
        self,
        lower: Sequence[float],
        upper: Sequence[float],
        friction: float = 0.0,
        restitution: float = 0.0,
        group: Any = None,
    ):
        super().__init__(friction, restitution, group)
        self.lower = self._corner("lower", lower, -np.inf)
        self.upper = self._corner("upper", upper, np.inf)
        if not (self.lower < self.upper).all():
            raise validate.fail(
                self.name, "upper", f"be above lower {self.lower.tolist()} [length]", self.upper,
                "swap the corners",
            )  # fmt: skip

    def _corner(self, name: str, value: Any, open_side: float) -> np.ndarray:
        sides = np.asarray(value, dtype=np.float64) if np.shape(value) == (3,) else None
        opened = np.zeros(3, dtype=bool) if sides is None else sides == open_side
        # The open sides are the only values that may be infinite.
        finite = value if sides is None else np.where(opened, 0.0, sides)
        corner = validate.vector(self.name, name, finite, unit="length")
        return np.where(opened, open_side, corner)

    def shapes(self) -> list[dict[str, Any]]:
        return [{"kind": "box", "lower": self.lower, "upper": self.upper}]

    def _kernels(self, *shape: Any) -> tuple[wp.Kernel, wp.Kernel, wp.Kernel]:
        return kernels.box_kernels(*shape)

    def _each(self, model: Model) -> Any:
        return model.precision.vec3

    def _check(self, model: Model, w: int) -> None:
        for axis, on in enumerate(model.periodic):
            if on and (np.isfinite(self.lower[axis]) or np.isfinite(self.upper[axis])):
                raise validate.fail(
                    self.name, f"sides along {'xyz'[axis]}", "be open where the scene is periodic",
                    [float(self.lower[axis]), float(self.upper[axis])], "use -inf and inf",
                )  # fmt: skip
