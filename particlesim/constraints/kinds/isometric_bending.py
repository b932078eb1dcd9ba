"""Bending of sheets that keep their lengths: quadratic in the positions."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine import topology
from ...engine.model import Model
from ...scene.law import law
from ..constraint import Constraint
from .bending import THIN

NAMES = ("k_0", "k_1", "k_2", "k_3")


@law
def _curvature(
    a: wp.vec3, b: wp.vec3, c: wp.vec3, d: wp.vec3, k_0: float, k_1: float, k_2: float, k_3: float
):
    return wp.length(k_0 * a + k_1 * b + k_2 * c + k_3 * d)


class IsometricBending(Constraint):
    r"""C = |sum_a k_a x_a| = 2 |x_1 - x_0| sin(theta / 2) / sqrt(A_0 + A_1): a flat sheet unfolds.

    The sum is the Laplacian by cotangents of two triangles with the edge x_0, x_1 in common
    (Bergou, Wardetzky, Harmon, Zorin and Grinspun 2006): of the sides' cotangents at x_0 and x_1

        k = (c_12 + c_13, c_02 + c_03, -c_02 - c_12, -c_03 - c_13) / sqrt(A_0 + A_1)

    with c_02 that at x_0 in the triangle with x_2, and so on. The coefficients are of the triangles
    at the start, each by itself, so that it need not be flat there. It is exact as long as the
    lengths are kept, and then as good as :class:`Bending` at any fold but cheaper. C^2 is a
    quadratic form: C / compliance is its force, which has no direction where C is 0. What is flat
    keeps its angular momentum therefore only about: a soft sheet that was thrown to some 1e-6 at
    substeps of 10 ms, a rigid one that was not quite flat to 0.1. :class:`Bending` keeps it.

    The energy of a hinge is C^2 / (2 compliance). With compliance = 1 / D for all hinges of a sheet
    of bending stiffness D = E h^3 / (12 (1 - nu^2)) [energy] this is Seung and Nelson's (1988): the
    factor 3 of Bergou et al., which makes a cylinder three times too stiff, is left out.

    Args:
        hinges: (m, 4) indices: the ends of the edge, then the wing of either triangle; those of a
            mesh are found by :func:`hinges`.
        compliance: 1 / D [1 / energy], one or (m,), at least 0.
        damping: beta [energy time], one or (m,), at least 0 (see :class:`Constraint`).
        break_force: Force on a particle beyond which a hinge no longer bends back [force], one or
            (m,), above 0; None: unbreakable.

    Raises:
        ValueError: Wrong shapes, indices or values; a triangle without an area at the start.

    Example:
        >>> IsometricBending([(0, 1, 2, 3)], compliance=1e3).particles.tolist()
        [[0, 1, 2, 3]]
    """

    relative = True

    def __init__(
        self, hinges: Any, *, compliance: Any = 0.0, damping: Any = 0.0, break_force: Any = None
    ):
        hinges = topology.tuples(self.name, "hinges", hinges, 4)
        super().__init__(
            _curvature, hinges, compliance=compliance, damping=damping, break_force=break_force,
            k_0=0.0, k_1=0.0, k_2=0.0, k_3=0.0,
        )  # fmt: skip

    def columns(self, model: Model, w: int) -> dict[str, np.ndarray]:
        x = topology.pieces(model, w, self.particles)
        edge = x[:, 1] - x[:, 0]
        squared, cotangents, areas = np.sum(edge**2, axis=1), {}, np.zeros(len(x))
        with np.errstate(invalid="ignore", divide="ignore"):
            thin = ~(squared > 0)
            for wing in (2, 3):
                side = x[:, wing] - x[:, 0]
                doubled = np.linalg.norm(np.cross(edge, side), axis=1)
                thin |= ~(doubled > THIN * squared)
                along = np.sum(edge * side, axis=1)
                cotangents[0, wing] = along / doubled
                cotangents[1, wing] = (squared - along) / doubled
                areas += 0.5 * doubled
            c = cotangents
            k = [
                c[1, 2] + c[1, 3], c[0, 2] + c[0, 3], -c[0, 2] - c[1, 2], -c[0, 3] - c[1, 3],
            ] / np.sqrt(areas)  # fmt: skip
        if thin.any():
            at = int(np.argmax(thin))
            raise validate.fail(
                self.name, f"hinges[{at}]", "have two triangles with an area at the start",
                self.particles[at].tolist(), "leave it out",
            )  # fmt: skip
        return super().columns(model, w) | dict(zip(NAMES, k, strict=True))
