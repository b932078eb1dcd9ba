"""Volumes of tetrahedra."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ...scene.law import law
from .rest import Resting

FLAT = 1e-6  # of the cube of its sides, below which there is no volume


@law
def _volume(a: wp.vec3, b: wp.vec3, c: wp.vec3, d: wp.vec3, rest_volume: float):
    return wp.dot(wp.cross(b - a, c - a), d - a) / 6.0 - rest_volume


class Volume(Resting):
    """C = (x_1 - x_0) x (x_2 - x_0) . (x_3 - x_0) / 6 - V: tetrahedra keep their volume.

    The volume has a sign: that of a right-handed row is positive, and one that was turned inside
    out has the wrong one and comes back. So does one that is flat; one whose particles are all on a
    line, where the volume has no gradient, stays as it is, and from near that a rigid one leaps far
    beyond, which the watchdog stops.

    Args:
        tetrahedra: (m, 4) indices.
        rest_volume: V [length^3], one or (m,), below 0 for left-handed rows; None: as at the start.
        compliance: alpha [length^6 / energy], one or (m,), at least 0: V_0 / K for a bulk modulus
            K [energy / length^3].
        damping: beta [energy time / length^6], one or (m,), at least 0 (see :class:`Constraint`).
        break_force: Force on a corner beyond which a tetrahedron is gone for good [force], one or
            (m,), above 0; None: unbreakable.

    Raises:
        ValueError: Wrong shapes, indices or values; a tetrahedron without a volume at the start,
            where no rest volume is given.

    Example:
        >>> Volume([(0, 1, 2, 3)], rest_volume=0.2, compliance=1e-6).particles.tolist()
        [[0, 1, 2, 3]]
    """

    argument, size, rest, exists = "tetrahedra", 4, "rest_volume", "a volume"

    def __init__(
        self, tetrahedra: Any, rest_volume: Any = None, *, compliance: Any = 0.0,
        damping: Any = 0.0, break_force: Any = None,
    ):  # fmt: skip
        own = {"compliance": compliance, "damping": damping, "break_force": break_force}
        super().__init__(_volume, tetrahedra, rest_volume, own)

    @staticmethod
    def quantity(x: np.ndarray) -> np.ndarray:
        u, v, w = (x[:, k] - x[:, 0] for k in (1, 2, 3))
        volume = np.sum(np.cross(u, v) * w, axis=1) / 6.0
        longest = np.linalg.norm(x[:, 1:] - x[:, :1], axis=2).max(axis=1, initial=0.0)
        return np.where(np.abs(volume) > FLAT * longest**3, volume, np.nan)
