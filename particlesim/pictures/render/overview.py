"""Overview: the camera that sees what there is to see of one frame or of many."""

from __future__ import annotations

from typing import Any

import numpy as np

from .camera import Camera, Framing
from .geometry import SHAPES, Geometry

MANY = 1000  # particles: of more, a few may be left out
MOST = 0.99  # of the particles, that are seen at each edge of the picture
FAR_OFF = 1.3  # times as far as for most of them would the camera be for all


class Overview:
    """Frames geometries, so that no high drop makes all others small.

    It sees all of scenes of up to 1000 particles. Of more it may leave out up to 1 % at each edge
    of the picture, where seeing these too would take the camera much farther away.

    Args:
        up: (3,).
        aspect: Width of the picture over its height.
    """

    def __init__(self, up: Any, aspect: float):
        self.aspect = aspect
        self.all, self.most = Framing(up, aspect), Framing(up, aspect)

    def add(self, geometry: Geometry) -> None:
        """What there is to see in one more frame."""
        self.all.add(*geometry.points())
        self._add_most(geometry)
        self.most.add(*geometry.points(*(name for name in SHAPES if name != "ball")))

    def add_around(self, geometry: Geometry, origin: np.ndarray) -> None:
        """The particles of one more frame, seen from an origin as their :func:`middle`."""
        points, radius = geometry.points(*_moving(geometry))
        self.all.add(points - origin, radius)
        self._add_most(geometry, origin)

    def _add_most(self, geometry: Geometry, origin: Any = 0.0) -> None:
        particles, radius = geometry.points("ball")
        self.most.add(particles - origin, radius, MOST if len(particles) > MANY else 1.0)

    def camera(self) -> Camera:
        """The camera; of nothing, one that sees the origin."""
        camera, nearer = self.all.camera(), self.most.camera()
        return camera if self.all.distance <= FAR_OFF * self.most.distance else nearer

    def seen_by(self, camera: Camera, geometry: Geometry) -> bool:
        """Whether a camera shows as much of a geometry's particles as this one would."""
        particles, radius = geometry.points("ball")
        share = MOST if len(particles) > MANY else 1.0
        return camera.sees(particles, radius, self.aspect, share)


def middle(geometry: Geometry) -> np.ndarray:
    """The mean of the particles' places, or of all points where there are none, (3,)."""
    points = geometry.points(*_moving(geometry))[0]
    return points.mean(axis=0, dtype=np.float64) if len(points) else np.zeros(3)


def _moving(geometry: Geometry) -> list[str]:
    """What a camera follows."""
    return ["ball"] if len(geometry.array("ball")) else list(SHAPES)


def overview(geometry: Geometry, up: Any, aspect: float) -> Camera:
    """The camera for one picture."""
    framed = Overview(up, aspect)
    framed.add(geometry)
    return framed.camera()
