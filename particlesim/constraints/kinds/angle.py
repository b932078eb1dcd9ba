"""Angles between pairs of neighbouring edges."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import warp as wp

from ...engine.model import Model
from ...kernels.constraints.kinds.coordinates import angle_evaluation
from ...scene.law import law
from .rest import Resting


@law
def _angle(a: wp.vec3, b: wp.vec3, c: wp.vec3, rest_angle: float):
    u, w = a - b, c - b
    return wp.atan2(wp.length(wp.cross(u, w)), wp.dot(u, w)) - rest_angle


class Angle(Resting):
    """C = phi - phi_0: the angle at the middle one of three particles, 0 to pi.

    It is taken from sine and cosine, so that it is good to all digits also where it is straight.
    Three particles on a line bend in a fixed plane; a middle on an end has no angle, and stays.

    A rod of bending stiffness E I [energy length] that is made of pieces of length l asks for a
    compliance of l / (E I), with rest angles of pi if it is straight.

    Args:
        triples: (m, 3) indices: an end, the middle, the other end.
        rest_angle: phi_0 [rad], one or (m,), 0 to pi; None: as at the start.
        compliance: alpha [rad^2 / energy], one or (m,), at least 0.
        damping: beta [energy time / rad^2], one or (m,), at least 0 (see :class:`Constraint`).
        break_force: Force on a particle beyond which it no longer bends back [force], one or (m,),
            above 0; None: unbreakable.
        yield_angle: How far one may be from its rest angle before that flows, as a wire that is
            bent beyond its strength [rad], one or (m,), at least 0; None: any.
        creep: How fast it flows, at least 0 [1 / time]: d phi_0/dt is that times what is beyond
            the yield (Bingham 1922).
        largest_angle: How far it flows from where it began, at least 0 [rad].

    Raises:
        ValueError: Wrong shapes, indices or values; a middle that is on an end at the start, where
            no rest angle is given; one that yields and is rigid.

    Example:
        >>> Angle([(0, 1, 2)], rest_angle=3.1, compliance=1e-3).particles.tolist()
        [[0, 1, 2]]
    """

    yields_by = "angle"
    argument, size, rest, exists = "triples", 3, "rest_angle", "a middle away from its ends"

    def __init__(
        self, triples: Any, rest_angle: Any = None, *, compliance: Any = 0.0, damping: Any = 0.0,
        break_force: Any = None, yield_angle: Any = None, creep: float = 1.0,
        largest_angle: float = math.pi,
    ):  # fmt: skip
        own = {"compliance": compliance, "damping": damping, "break_force": break_force}
        super().__init__(_angle, triples, rest_angle, own)
        self._within(0.0, math.pi)
        self._yields(yield_angle, creep, largest_angle)

    @staticmethod
    def quantity(x: np.ndarray) -> np.ndarray:
        u, w = x[:, 0] - x[:, 1], x[:, 2] - x[:, 1]
        sine = np.linalg.norm(np.cross(u, w), axis=1)
        angle = np.arctan2(sine, np.sum(u * w, axis=1))
        return np.where(u.any(axis=1) & w.any(axis=1), angle, np.nan)

    def evaluation(self, model: Model, item: Any) -> wp.Function:
        return angle_evaluation(model.precision, item)
