"""Areas of triangles."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ...scene.law import law
from .rest import Resting

FLAT = 1e-6  # of the square of its sides, below which there is no area


@law
def _area(a: wp.vec3, b: wp.vec3, c: wp.vec3, rest_area: float):
    return 0.5 * wp.length(wp.cross(b - a, c - a)) - rest_area


class Area(Resting):
    """C = |(x_1 - x_0) x (x_2 - x_0)| / 2 - A: triangles keep their area.

    Their shape they do not keep. One that has collapsed to a line, where the area has no gradient,
    stays as it is; from near it a rigid one leaps far beyond, which the watchdog stops.

    Args:
        triangles: (m, 3) indices.
        rest_area: A [length^2], one or (m,), at least 0; None: as at the start.
        compliance: alpha [length^4 / energy], one or (m,), at least 0: a pressure (A - A_0) / alpha
            along the sheet [force / length].
        damping: beta [energy time / length^4], one or (m,), at least 0 (see :class:`Constraint`).
        break_force: Force on a corner beyond which a triangle is gone for good [force], one or
            (m,), above 0; None: unbreakable.

    Raises:
        ValueError: Wrong shapes, indices or values; a triangle without an area at the start, where
            no rest area is given.

    Example:
        >>> Area([(0, 1, 2)], rest_area=0.5).particles.tolist()
        [[0, 1, 2]]
    """

    argument, size, rest, exists = "triangles", 3, "rest_area", "an area"

    def __init__(
        self, triangles: Any, rest_area: Any = None, *, compliance: Any = 0.0, damping: Any = 0.0,
        break_force: Any = None,
    ):  # fmt: skip
        own = {"compliance": compliance, "damping": damping, "break_force": break_force}
        super().__init__(_area, triangles, rest_area, own)
        self._within(0.0)

    @staticmethod
    def quantity(x: np.ndarray) -> np.ndarray:
        u, v = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]
        area = 0.5 * np.linalg.norm(np.cross(u, v), axis=1)
        longest = np.maximum(np.sum(u**2, axis=1), np.sum(v**2, axis=1))
        return np.where(area > FLAT * longest, area, np.nan)
