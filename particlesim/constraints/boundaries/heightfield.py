"""Boundaries of heights over a grid."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...kernels.constraints.boundaries import grids as kernels
from ...kernels.precision import Precision
from .combined import ShapedBoundary
from .motion import Motion
from .solid import STILL


class HeightfieldBoundary(ShapedBoundary):
    """What is above a surface of heights over a grid: ground.

    Each cell is two triangles, cut from node (i, j) to node (i + 1, j + 1). Particles are held off
    from the nearest point of them. What is below the surface is in the ground, however deep, so
    that nothing falls through. Beyond the grid the heights of its edge go on.

    Args:
        heights: Of node (i, j), over ``lower`` along ``up``, (n, m) [length], 2 or more along each
            axis.
        lower: Where node (0, 0) of height 0 is, (3,) [length].
        spacing: Of the nodes along the other two axes, of which the first goes with i [length].
        friction: mu, at least 0.
        restitution: e, 0 to 1: speed after over speed before, both against the surface's.
        group: Which particles it holds; None: all.
        up: ``"x"``, ``"y"`` or ``"z"``, as of the scene.
        velocity: Of the ground, (3,) [length/time].
        angular_velocity: About the pivot, (3,) [rad/time].
        pivot: What it turns about, as described, (3,) [length].
        slip: A fluid slips along it; False: a viscous one sticks to it.
        motion: A ``Trajectory`` or ``Keyframes`` in the place of both velocities.

    Raises:
        ValueError: Values out of range; a periodic scene, but for an axis along which all heights
            are the same.

    Example:
        >>> x = np.linspace(0, 4, 41)
        >>> hills = HeightfieldBoundary(
        ...     0.2 * np.sin(x[:, None]) * np.cos(x), (0, 0, 0), 0.1, friction=0.6)
        >>> hills.heights.shape
        (41, 41)
    """

    sides = 3

    def __init__(
        self, heights: Any, lower: Sequence[float], spacing: float, friction: float = 0.0,
        restitution: float = 0.0, group: Any = None, *, up: str = "y",
        velocity: Sequence[float] = STILL, angular_velocity: Sequence[float] = STILL,
        pivot: Sequence[float] = STILL, slip: bool = True, motion: Motion | None = None,
    ):  # fmt: skip
        self._holds(friction, restitution, group, velocity, angular_velocity, slip, motion)
        self.pivot = validate.vector(self.name, "pivot", pivot, unit="length")
        self.heights = validate.grid(self.name, "heights", heights, 2)
        self.lower = validate.vector(self.name, "lower", lower, unit="length")
        self.spacing = validate.number(self.name, "spacing", spacing, above=0.0, unit="length")
        self.up = "xyz".index(validate.choice(self.name, "up", up, "xyz"))
        self.level = [axis for axis in range(3) if axis != self.up]
        self._made: dict[tuple[str, str], wp.array] = {}

    def near(self, precision: Precision, params: Any) -> wp.Function:
        return kernels.heights_near(precision, params)

    def _geometry(self, device: Any, precision: Precision) -> dict[str, Any]:
        key = str(device), precision.name
        if key not in self._made:
            self._made[key] = wp.array(self.heights, dtype=precision.scalar, device=device)
        return {
            "heights": self._made[key], "lower": self.lower, "spacing": self.spacing,
            "inverse": 1.0 / self.spacing, "first": self.level[0], "second": self.level[1],
            "up": self.up, "room": np.inf,
        }  # fmt: skip

    def shapes(self) -> list[dict[str, Any]]:
        n, m = self.heights.shape
        i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
        points = np.zeros((n * m, 3)) + self.lower
        points[:, self.level[0]] += self.spacing * i.ravel()
        points[:, self.level[1]] += self.spacing * j.ravel()
        points[:, self.up] += self.heights.ravel()
        at = (i * m + j)[:-1, :-1].ravel()
        first = np.stack([at, at + m, at + m + 1], axis=1)
        second = np.stack([at, at + m + 1, at + 1], axis=1)
        triangles = np.concatenate([first, second])
        # Seen from above they go round counterclockwise, unless the axes are left-handed.
        if self.up == 1:
            triangles = triangles[:, ::-1]
        mesh = {"points": points, "triangles": triangles, "container": False}
        return [self._shape("mesh", **mesh)]
