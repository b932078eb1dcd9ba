"""Boundaries by the nearest point of their surface."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine.limit import Limit
from ...engine.probe import Probe
from ...kernels.constraints.boundaries import nearest as kernels
from ...kernels.parameters import by_name, parameter_types, structures
from ...kernels.precision import FLOAT64, Precision, structure
from ..limits import crossing_limits
from .solid import SolidBoundary


class NearestBoundary(SolidBoundary):
    """Base of boundaries that know the nearest point of their surface, with its normal.

    A particle that touches several parts of the surface at once is brought back from one after the
    other, the nearest first, ``sides`` of them in each sweep.

    A fluid sees the nearest point alone, so that in a corner it has images of one side. In those of
    planes, of a box and of a cylinder's inside it has all.

    A member gives ``near``, what that takes, and its ``shapes``.
    """

    def distance(self, points: Any) -> np.ndarray:
        """The signed distance at points (n, 3) [length] of the boundary as described.

        Returns:
            (n,) [length], positive where particles may be.
        """
        x = validate.rows(f"{self.name}.distance", "points", points, None, 3)
        values = self._geometry("cpu", FLOAT64)
        Params = structure(f"{type(self).__name__}Distance", parameter_types(values, FLOAT64))
        given = structures(Params, by_name([values]), "cpu")
        kernel = kernels.nearest_kernel(self.near(FLOAT64, Params), Params)
        found = wp.empty(len(x), dtype=wp.float64, device="cpu")
        places = wp.array(x, dtype=wp.vec3d, device="cpu")
        wp.launch(kernel, len(x), [given, places], [found], device="cpu")
        return found.numpy()

    def surface(self, precision: Precision) -> wp.Function:
        near = self.near(precision, self.Params)
        return kernels.nearest_sides(near, self.sides, self.tracked, precision, self.Params)

    def facing(self, precision: Precision, params: Any) -> wp.Function:
        return kernels.nearest_facing(self.near(precision, params), precision, params)

    def limits(self, probe: Probe) -> list[Limit]:
        """|v| dt <= how thick or wide it is."""
        return crossing_limits(
            self, probe, ["width / v"],
            lambda peer, v: peer.width() / np.linalg.norm(v, axis=1, keepdims=True),
        )  # fmt: skip
