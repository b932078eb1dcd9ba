"""Bending of sheets about the edges between triangles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine.model import Model
from ...engine.neighbors.lists import Neighbors
from ...engine.state import State
from ...kernels.constraints.kinds.coordinates import hinge_evaluation
from ...scene.constraint_base import ConstraintBase
from ...scene.law import law
from ..distance import Distance
from .rest import Resting
from .tearing import Tearing

THIN = 1e-6  # a triangle whose height over its edge is a smaller part of it is none


@law
def _fold(a: wp.vec3, b: wp.vec3, c: wp.vec3, d: wp.vec3, rest_angle: float):
    edge = wp.normalize(b - a)
    m, n = wp.cross(b - a, c - a), wp.cross(d - a, b - a)
    return wp.atan2(wp.dot(wp.cross(m, n), edge), wp.dot(m, n)) - rest_angle


class Bending(Resting):
    r"""C = theta - theta_0: the fold of two triangles about their common edge.

    theta is the angle from the normal (x_1 - x_0) x (x_2 - x_0) of one triangle to the normal
    (x_3 - x_0) x (x_1 - x_0) of the other about x_1 - x_0: 0 where both are in one plane, -pi or pi
    where one lies on the other (Bridson, Marino and Fedkiw 2003). It is taken from sine and cosine,
    so that it and its gradient are good to all digits however flat or folded the hinge is; C is the
    nearer way round.

    A hinge of stiffness k, 1 / compliance, holds k (theta - theta_0)^2 / 2 [energy]. A sheet of
    bending stiffness D = E h^3 / (12 (1 - nu^2)) [energy] asks for

        k = D |x_1 - x_0|^2 / (A_0 + A_1)

    with the areas A of both triangles: k = 2 D / sqrt(3) where they are equilateral (Seung and
    Nelson 1988). A cylinder then has the energy D kappa^2 / 2 an area. How bends along and across
    go together is the mesh's: of right-angled triangles that all lean one way a bend comes with a
    twist, and a free strip is 1/4 softer; with the side alternating it is not.

    Where a triangle is thinner than a thousandth of its sides the gradient, which would grow
    without bound, fades, and vanishes where it is none.

    Args:
        hinges: (m, 4) indices: the ends of the edge, then the wing of either triangle; those of a
            mesh are found by :func:`hinges`.
        rest_angle: theta_0 [rad], one or (m,), -pi to pi; None: as at the start.
        compliance: 1 / k [rad^2 / energy], one or (m,), at least 0.
        damping: beta [energy time / rad^2], one or (m,), at least 0 (see :class:`Constraint`).
        break_force: Force on a particle beyond which a hinge no longer bends back [force], one or
            (m,), above 0; None: unbreakable.
        yield_angle: How far one may be from its rest angle before that flows, as a wire that is
            bent beyond its strength [rad], one or (m,), at least 0; None: any.
        creep: How fast it flows, at least 0 [1 / time]: d theta_0/dt is that times what is beyond
            the yield (Bingham 1922).
        largest_angle: How far it flows from where it began, at least 0 [rad].
        edges: A ``Distance`` with a ``break_force`` along the sides of the triangles, which the
            scene has before: a hinge goes with the first side of its triangles that is torn.

    Raises:
        ValueError: Wrong shapes, indices or values; a triangle without an area at the start, where
            no rest angle is given; a hinge that yields and is rigid.

    Example:
        >>> Bending([(0, 1, 2, 3)], rest_angle=0.0, compliance=1e-3).particles.tolist()
        [[0, 1, 2, 3]]
    """

    yields_by = "angle"
    argument, size, rest, exists = "hinges", 4, "rest_angle", "two triangles with an area"

    def __init__(
        self, hinges: Any, rest_angle: Any = None, *, compliance: Any = 0.0, damping: Any = 0.0,
        break_force: Any = None, yield_angle: Any = None, creep: float = 1.0,
        largest_angle: float = math.pi, edges: Distance | None = None,
    ):  # fmt: skip
        own = {"compliance": compliance, "damping": damping, "break_force": break_force}
        super().__init__(_fold, hinges, rest_angle, own)
        self._within(-math.pi * (1 + 1e-15), math.pi * (1 + 1e-15))
        self._yields(yield_angle, creep, largest_angle)
        if edges is not None and getattr(edges, "break_force", None) is None:
            raise validate.fail(
                self.name, "edges", "be a Distance with a break_force", edges, "leave it out"
            )
        self.edges = edges

    @staticmethod
    def quantity(x: np.ndarray) -> np.ndarray:
        edge, near, far = (x[:, k] - x[:, 0] for k in (1, 2, 3))
        m, n = np.cross(edge, near), np.cross(far, edge)
        length = np.linalg.norm(edge, axis=1)
        high = np.minimum(np.linalg.norm(m, axis=1), np.linalg.norm(n, axis=1)) / length**2
        fold = np.arctan2(np.sum(np.cross(m, n) * edge, axis=1) / length, np.sum(m * n, axis=1))
        return np.where(high > THIN, fold, np.nan)

    def kind(self) -> tuple[Any, ...]:
        return (*super().kind(), self.edges is None)

    @property
    def breakable(self) -> bool:
        return super().breakable or self.edges is not None

    def meet(self, constraints: Sequence[ConstraintBase]) -> None:
        if self.edges is None:
            return
        mine = [peer.edges for peer in self.peers]
        before = list(constraints)[: list(constraints).index(self)]
        found = [
            each
            for each in before
            if isinstance(each, Distance) and [*map(id, each.peers)] == [*map(id, mine)]
        ]
        if not found:
            raise validate.fail(
                self.name, "edges", "be in the scene before the hinges", self.edges,
                "add it first",
            )  # fmt: skip
        self.edges = found[0]

    def attach(self, model: Model, state: State) -> None:
        super().attach(model, state)
        if self.count and self.edges is not None:
            self.tearing = Tearing(self, self.edges)

    def finish(self, state: State, neighbors: Neighbors, dt: float) -> None:
        super().finish(state, neighbors, dt)
        if self.count and self.edges is not None:
            self.tearing.tear()

    def evaluation(self, model: Model, item: Any) -> wp.Function:
        return hinge_evaluation(model.precision, item)


def hinges(triangles: Any) -> np.ndarray:
    """The inner edges of a mesh of triangles as ``Bending`` takes them.

    Args:
        triangles: (t, 3) indices.

    Returns:
        (m, 4) indices: both ends of an edge, in the order in which the first of its triangles goes
        round, then the wing of the first triangle and that of the second. An edge with more than
        two triangles gives a hinge between each and the next.

    Raises:
        ValueError: No triangles, or one with two corners that are the same.

    Example:
        >>> hinges([(0, 1, 2), (2, 1, 3)]).tolist()
        [[1, 2, 0, 3]]
    """
    array = np.asarray(triangles)
    count = int(array.max()) + 1 if array.size and array.dtype.kind in "iu" else 0
    rows = validate.triangles("hinges", triangles, count)
    corners = np.concatenate([np.roll(rows, -k, axis=1) for k in range(3)])  # end, end, wing
    owner = np.tile(np.arange(len(rows)), 3)
    low, high = corners[:, :2].min(axis=1), corners[:, :2].max(axis=1)
    order = np.lexsort([owner, high, low])
    shared = (low[order][1:] == low[order][:-1]) & (high[order][1:] == high[order][:-1])
    first, second = corners[order[:-1][shared]], corners[order[1:][shared]]
    return np.column_stack([first[:, :2], first[:, 2], second[:, 2]])
