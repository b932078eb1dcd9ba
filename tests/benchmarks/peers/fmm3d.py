"""FMM3D (Greengard et al. 2021), float64: multipoles, without softening."""

import numpy as np

from particlesim.accuracy.bench.case import Entry, Place
from peers.leapfrog import Leapfrog


def _start(place: Place, count: int, steps: int, error: float) -> Leapfrog:
    import fmm3dpy

    charges = np.full(count, 4 * np.pi / count)  # it sums 1 / (4 pi r)

    def accelerate(x: np.ndarray) -> np.ndarray:
        return fmm3dpy.lfmm3d(eps=error, sources=x.T, charges=charges, pg=2).grad.T

    return Leapfrog(count, steps, accelerate)


def bodies(count: int, steps: int, error: float) -> Entry:
    """The sphere; ``error``: relative, that it is asked for."""
    return Entry(lambda place: _start(place, count, steps, error), "float64", "fmm3dpy")
