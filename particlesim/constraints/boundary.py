"""Boundaries: what holds particles off by their radius, from one law, its signed distance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from .. import validate
from ..interactions.laws.arguments import Arguments
from ..kernels.constraints import boundary_shapes as kernels
from ..kernels.constraints import walls
from ..kernels.constraints.boundaries import ready
from ..kernels.precision import FLOAT64, Precision, structure
from ..scene.law import law as make_law
from .boundaries.combined import Combinable
from .boundaries.drawing import level_set, nodes
from .boundaries.motion import Motion
from .boundaries.solid import STILL, SolidBoundary

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


class Boundary(Combinable, SolidBoundary):
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
        return (*super().kind(), *given)

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

    def shapes(self) -> list[dict[str, Any]]:
        """Its surface in the box that is drawn, clear where it closes in the particles."""
        if self._box is None:
            return []
        places, counts = nodes(*self._box)
        mesh = level_set(self.distance(places).reshape(counts), *self._box)
        return [self._shape("mesh", **mesh)] if mesh else []

    def _geometry(self, device: Any, precision: Precision) -> dict[str, Any]:
        """What the surface takes, by name."""
        return self.parameters

    def surface(self, precision: Precision) -> wp.Function:
        """Where it is, as a Warp function (see kernels.constraints.boundary_shapes)."""
        law = self.law.function(precision, self.name, float)
        return kernels.distance_function(law, tuple(self.parameters), precision, self.Params)

    def facing(self, precision: Precision, params: Any) -> wp.Function:
        law = self.law.function(precision, self.name, float)
        return walls.distance_facing(law, tuple(self.parameters), precision, params)

    def near(self, precision: Precision, params: Any) -> wp.Function:
        """The nearest point, as a Warp function (see kernels.constraints.boundaries.nearest)."""
        law = self.law.function(precision, self.name, float)
        return ready.law_near(law, tuple(self.parameters), precision, params)
