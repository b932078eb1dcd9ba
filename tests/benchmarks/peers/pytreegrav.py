"""pytreegrav (Grudic and Gurvich 2021), float64: its tree, or its direct sum."""

import numpy as np
from work.bodies import SOFTENING

from particlesim.accuracy.bench.case import Entry, Place
from peers.leapfrog import Leapfrog

KERNEL = 2.8  # its kernel has the depth of a Plummer sphere of this part of its radius


def _start(place: Place, count: int, steps: int, method: str, theta: float) -> Leapfrog:
    import pytreegrav

    m, h = np.full(count, 1.0 / count), np.full(count, KERNEL * SOFTENING)

    def accelerate(x: np.ndarray) -> np.ndarray:
        return pytreegrav.Accel(
            x, m, h, theta=theta, parallel=place.threads > 1, method=method
        )  # fmt: skip

    return Leapfrog(count, steps, accelerate)


def bodies(count: int, steps: int, method: str, theta: float = 0.7) -> Entry:
    """The sphere; ``method``: ``"tree"`` or ``"bruteforce"``; ``theta``: of its tree."""
    return Entry(lambda place: _start(place, count, steps, method, theta), "float64", "pytreegrav")
