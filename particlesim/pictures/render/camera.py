"""Camera: where a picture is taken from."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ... import validate

FIELD_OF_VIEW = 32.3  # degrees; a lens of 35 mm on a picture 20.25 mm high
VIEW = (0.35, 0.35, 1.0)  # from what is seen to the camera: right, up, out
ROOM = 1.05  # of the picture, around what is seen
CENTERINGS = 8


@dataclass(frozen=True, eq=False)
class Camera:
    """A pinhole camera.

    Args:
        position: Where it is, (3,) [length].
        target: What is in the middle of the picture, (3,) [length].
        up: What is up in the picture, (3,).
        field_of_view: Angle between the lower and the upper edge of the picture [degrees].

    Raises:
        ValueError: Position and target are one point, ``up`` is along the view or nothing, an
            angle outside 0..180.

    Example:
        >>> camera = Camera((0, 0, 5), (0, 0, 0))
        >>> camera.axes[2].tolist()
        [0.0, 0.0, 1.0]
    """

    position: Any
    target: Any
    up: Any = (0.0, 1.0, 0.0)
    field_of_view: float = FIELD_OF_VIEW

    def __post_init__(self) -> None:
        owner = "Camera"
        for name in ("position", "target", "up"):
            unit = "" if name == "up" else "length"
            vector = validate.vector(owner, name, getattr(self, name), unit=unit)
            object.__setattr__(self, name, vector)
        angle = validate.number(owner, "field_of_view", self.field_of_view, above=0, unit="degrees")
        if angle >= 180:
            raise validate.fail(
                owner, "field_of_view", "be below 180 [degrees]", angle, "give a smaller one"
            )
        back = self.position - self.target
        if not np.any(back):
            raise validate.fail(
                owner, "target", "be another point than position", self.target, "move one"
            )
        across = np.linalg.norm(np.cross(self.up, back))
        if across <= 1e-9 * np.linalg.norm(self.up) * np.linalg.norm(back):
            raise validate.fail(
                owner, "up", "point out of the line of view", self.up, "give another direction"
            )

    @property
    def axes(self) -> np.ndarray:
        """Right, up and back (against the view), orthonormal rows, (3, 3)."""
        return view_axes(self.position - self.target, self.up)

    @property
    def slope(self) -> float:
        """Half the height of the picture at distance 1."""
        return math.tan(math.radians(0.5 * self.field_of_view))

    @classmethod
    def around(cls, points: Any, up: Any, aspect: float, radius: Any = 0.0) -> Camera:
        """The nearest camera that sees all of some points, from a little to the right and above.

        The right edge of the picture, of slope k, touches the points that are highest in
        a / k + c, with a to the right and c towards the camera; the left one those in -a / k + c.
        That gives the distance and the middle; likewise for up and down.

        Args:
            points: (n, 3) [length], at least one.
            up: (3,).
            aspect: Width of the picture over its height.
            radius: Of spheres around the points, one or (n,) [length].
        """
        x = np.asarray(points, dtype=np.float64)
        # Up and out as in scenes whose up is y; for z the camera looks along y.
        out = (0.0, -1.0, 0.0) if abs(up[2]) > max(abs(up[0]), abs(up[1])) else (0.0, 0.0, 1.0)
        right = np.cross(up, out)
        back = np.array(VIEW) @ np.array([right, np.asarray(up, dtype=np.float64), out])
        axes = view_axes(back, up)
        middle = 0.5 * (x.min(axis=0) + x.max(axis=0))
        *across, depth = axes @ (x - middle).T
        slope = math.tan(math.radians(0.5 * FIELD_OF_VIEW)) / ROOM
        offsets, distance = [], 0.0
        for along, k in zip(across, (slope * aspect, slope), strict=True):
            reach = np.asarray(radius) * math.hypot(1.0, 1.0 / k)
            first, second = (np.max(side / k + depth + reach) for side in (along, -along))
            offsets.append(0.5 * k * (first - second))
            distance = max(distance, 0.5 * (first + second))
        distance = distance or 1.0
        for _ in range(CENTERINGS):  # the direction that has room: as much on either side
            for each, along in enumerate(across):
                seen = (along - offsets[each]) / (distance - depth)
                offsets[each] += 0.5 * distance * float(seen.min() + seen.max())
        target = middle + offsets @ axes[:2]
        return cls(target + distance * axes[2], target, up)


def view_axes(back: Any, up: Any) -> np.ndarray:
    """Right, up and back of what looks against ``back``, orthonormal rows, (3, 3)."""
    out = np.asarray(back, dtype=np.float64) / np.linalg.norm(back)
    right = np.cross(up, out)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(out, right), out])
