"""Hinges between rigid clusters, and between one and the world."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ... import validate
from .joints import BallJoint


class Hinge(BallJoint):
    """A ball joint whose sides turn against each other about one axis only, within limits.

    Args:
        a: See :class:`BallJoint`. b: Likewise.
        point: A point of the axis at the start [length], (3,); (m, 3) for m joints.
        axis: Its direction at the start, (3,) or (m, 3), of any length above 0.
        lower: Least angle of b against a, right-handed about the axis [rad], from -pi to 0, one
            or one a joint; None: as far as it goes.
        upper: Largest angle [rad], from 0 to pi, likewise.
        compliance: See :class:`BallJoint`; the axes are rigid. break_force: Likewise.

    Raises:
        ValueError: As of BallJoint; an axis without a direction; limits out of range.

    Example:
        >>> Hinge([0, 1, 2], [3, 4, 5], (0, 0, 0), (0, 0, 1), lower=-0.5).upper.tolist()
        [3.141592653589793]
    """

    def __init__(
        self, a: Any, b: Any, point: Any, axis: Any, lower: Any = None, upper: Any = None, *,
        compliance: Any = 0.0, break_force: Any = None,
    ):  # fmt: skip
        super().__init__(a, b, point, compliance=compliance, break_force=break_force)
        name, count = self.name, len(self.point)
        given = validate.rows(name, "axis", axis, count, 3)
        largest = np.abs(given).max(axis=1, keepdims=True)
        if count and not largest.min() > 0:
            raise validate.fail(
                name, f"axis[{int(np.argmin(largest))}]", "have a direction", given, "give one"
            )
        scaled = given / largest
        self.axis = scaled / np.linalg.norm(scaled, axis=1, keepdims=True)
        self.lower = self._bound("lower", -math.pi if lower is None else lower, -math.pi, 0.0)
        self.upper = self._bound("upper", math.pi if upper is None else upper, 0.0, math.pi)

    def _bound(self, which: str, value: Any, least: float, most: float) -> np.ndarray:
        bound = validate.rows(self.name, which, value, len(self.point), None)
        good = (bound >= least) & (bound <= most)
        if not good.all():
            at = int(np.argmin(good))
            raise validate.fail(
                self.name, f"{which}[{at}]", f"be from {least:g} to {most:g} [rad]",
                float(bound[at]), "count angles from the start",
            )  # fmt: skip
        return bound

    def _angles(self) -> dict[str, np.ndarray]:
        found = {**self._values("axis"), **self._values("lower"), **self._values("upper")}
        axis = found["axis"]
        side = np.eye(3)[np.argmin(np.abs(axis), axis=1)]
        across = np.cross(axis, side)
        return {**found, "arm": across / np.linalg.norm(across, axis=1, keepdims=True)}
