"""Distances between pairs of particles: rods, springs, struts and ropes."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from .. import validate
from ..engine import topology
from ..engine.model import Model
from ..kernels.constraints.constraints import distance_evaluation
from ..scene.law import law
from .solving.plasticity import Plastic


@law
def _distance(a: wp.vec3, b: wp.vec3, rest_length: float):
    return wp.length(b - a) - rest_length


class Distance(Plastic):
    """C = |x_1 - x_0| - L: the pairs keep their distance.

    Coincident ends are pushed apart, along a fixed direction. Far from the origin the distance is
    as exact as near to it where ``Settings.compensated`` is on.

    One that yields is a wire of metal: stretched or pressed by more than ``yield_strain`` of its
    length at the start, it comes to rest at another length, at the rate dL/dt = creep times what
    is beyond the yield (Bingham 1922). A rope yields as it is pulled, a strut as it is pressed.

    Args:
        pairs: (m, 2) indices of the ends.
        rest_length: L [length], one or (m,), at least 0, in a periodic scene at most half a box;
            None: the distances at the start, there to the nearest image.
        compliance: alpha, the inverse of the stiffness [length / force], one or (m,), at least 0.
        damping: beta [force time / length], one or (m,), at least 0 (see :class:`Constraint`).
        inequality: Hold the distance to at least L: a strut that only pushes.
        tension_only: Hold the distance to at most L: a rope that only pulls.
        break_force: Force beyond which a pair is torn for good [force], one or (m,), above 0;
            None: unbreakable.
        yield_strain: Parts of its length at the start by which a pair may be off L before that
            flows, one or (m,), at least 0; None: any.
        creep: How fast it flows, at least 0 [1 / time].
        largest_strain: How far it flows, |L - L_0| / L_0, at least 0.

    Raises:
        ValueError: Wrong shapes, ends that are the same, negative values, a strut that is a rope,
            a pair that yields and is rigid.

    Example:
        >>> rope = Distance([(0, 1), (1, 2)], rest_length=0.5, tension_only=True)
        >>> rope.links().tolist()
        [[0, 1], [1, 2]]
    """

    rest = "rest_length"
    relative = True
    unit = True

    def __init__(
        self, pairs: Any, rest_length: Any = None, *, compliance: Any = 0.0, damping: Any = 0.0,
        inequality: bool = False, tension_only: bool = False, break_force: Any = None,
        yield_strain: Any = None, creep: float = 1.0, largest_strain: float = 1.0,
    ):  # fmt: skip
        if inequality and tension_only:
            raise validate.fail(
                self.name, "tension_only", "be False with inequality", tension_only,
                "use Distance without both for a rod",
            )  # fmt: skip
        pairs = topology.tuples(self.name, "pairs", pairs, 2)
        self.from_start, self.tension_only = rest_length is None, bool(tension_only)
        length = 0.0 if rest_length is None else rest_length
        super().__init__(
            _distance,
            pairs,
            compliance=compliance,
            damping=damping,
            inequality=inequality or tension_only,
            break_force=break_force,
            rest_length=topology.per_item(
                self.name, "rest_length", length, len(pairs), minimum=0
            ),
        )  # fmt: skip
        self._yields(yield_strain, creep, largest_strain)

    @property
    def _sense(self) -> int:
        return -1 if self.tension_only else 1

    def kind(self) -> tuple[Any, ...]:
        return (*super().kind(), self.tension_only)

    def columns(self, model: Model, w: int) -> dict[str, np.ndarray]:
        given = None if self.from_start else self.parameters["rest_length"]
        lengths = topology.rest_lengths(self.name, model, w, self.particles, given)
        return {**super().columns(model, w), "rest_length": lengths}

    def evaluation(self, model: Model, item: Any) -> wp.Function:
        return distance_evaluation(self._sense, model.precision, item)
