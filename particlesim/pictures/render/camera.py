"""Camera: where a picture is taken from."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ... import validate

FIELD_OF_VIEW = 32.3  # degrees; a lens of 35 mm on a picture 20.25 mm high
VIEW = (0.35, 0.35, 1.0)  # from what is seen to the camera: right, up, out
ROOM = 1.05  # of the picture, around what is seen
NEAREST = 0.25  # of the size of what is seen: no nearer is the camera to it


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

    def moved(self, way: Any) -> Camera:
        """The same somewhere else, by (3,) [length]."""
        return replace(self, position=self.position + way, target=self.target + way)

    @classmethod
    def around(cls, points: Any, up: Any, aspect: float, radius: Any = 0.0) -> Camera:
        """The nearest camera that sees all of some points, from a little to the right and above.

        Args:
            points: (n, 3) [length], at least one.
            up: (3,).
            aspect: Width of the picture over its height.
            radius: Of spheres around the points, one or (n,) [length].
        """
        framing = Framing(up, aspect)
        framing.add(points, radius)
        return framing.camera()

    def sees(self, points: Any, radius: Any, aspect: float, share: float = 1.0) -> bool:
        """Whether a share of some spheres, as of :meth:`around`, is within each edge."""
        if not len(points):
            return True
        x = np.asarray(points, dtype=np.float64) - self.position
        right, up, back = self.axes @ x.T
        edges = []
        for along, k in ((right, self.slope * aspect), (up, self.slope)):
            edges += [side + k * back + radius * math.hypot(1.0, k) for side in (along, -along)]
        return all(_most(edge, share) <= 0.0 for edge in edges)


class Framing:
    """What a camera has to see, which may come in parts: of one frame, or of many.

    The right edge of the picture, of slope k, touches the spheres that are highest in
    a / k + c + r sqrt(1 + 1 / k^2), with a to the right and c towards the camera; the left one
    those in -a / k + c + ...; likewise for up and down. That gives the distance and the middle:
    as far from one edge as from the other.

    Args:
        up: (3,).
        aspect: Width of the picture over its height.
    """

    def __init__(self, up: Any, aspect: float):
        self.up = np.asarray(up, dtype=np.float64)
        # Up and out as in scenes whose up is y; for z the camera looks along y.
        out = (0.0, -1.0, 0.0) if abs(up[2]) > max(abs(up[0]), abs(up[1])) else (0.0, 0.0, 1.0)
        back = np.array(VIEW) @ np.array([np.cross(self.up, out), self.up, out])
        self.axes = view_axes(back, self.up)
        slope = math.tan(math.radians(0.5 * FIELD_OF_VIEW)) / ROOM
        self.slopes = (slope * aspect, slope)
        self.reached = np.full((2, 2), -np.inf)  # right and left, up and down
        self.low, self.high = np.full(3, np.inf), np.full(3, -np.inf)  # along the axes

    def add(self, points: Any, radius: Any = 0.0, share: float = 1.0) -> None:
        """Points (n, 3) that are to be seen, as spheres; ``share``: how many, at each edge."""
        x = np.asarray(points, dtype=np.float64)
        if not len(x):
            return
        r = np.broadcast_to(np.asarray(radius, dtype=np.float64), len(x))
        seen = self.axes @ x.T
        for axis, k in enumerate(self.slopes):
            reach = seen[2] + r * math.hypot(1.0, 1.0 / k)
            for side, along in enumerate((seen[axis], -seen[axis])):
                most = _most(along / k + reach, share)
                self.reached[axis, side] = max(self.reached[axis, side], most)
        for axis, along in enumerate(seen):
            self.low[axis] = min(self.low[axis], -_most(r - along, share))
            self.high[axis] = max(self.high[axis], _most(along + r, share))

    @property
    def distance(self) -> float:
        """From the middle of what is seen to the camera [length]."""
        size = float(np.linalg.norm(self.high - self.low))
        front = self.high[2] + (NEAREST * size or 1.0)
        needed = max(float(0.5 * each.sum()) for each in self.reached)
        return float(max(front, needed) - 0.5 * (self.low[2] + self.high[2]))

    def camera(self) -> Camera:
        """The nearest camera that sees all that was added; of nothing, one that sees the origin."""
        if not np.isfinite(self.reached).all():
            self.add([(0.0, 0.0, 0.0)], 1.0)
        middle = [
            0.5 * k * (first - second)
            for k, (first, second) in zip(self.slopes, self.reached, strict=True)
        ]
        target = np.array([*middle, 0.5 * (self.low[2] + self.high[2])]) @ self.axes
        return Camera(target + self.distance * self.axes[2], target, self.up)


def _most(values: np.ndarray, share: float) -> float:
    """What a share of the values is not above."""
    if share == 1.0:
        return float(values.max())
    return float(np.quantile(values, share, method="higher"))


def view_axes(back: Any, up: Any) -> np.ndarray:
    """Right, up and back of what looks against ``back``, orthonormal rows, (3, 3)."""
    out = np.asarray(back, dtype=np.float64) / np.linalg.norm(back)
    right = np.cross(up, out)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(out, right), out])
