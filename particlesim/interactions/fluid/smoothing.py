"""Smoothing functions W(r, h) of SPH, as laws of q = r / h."""

from __future__ import annotations

import math
from dataclasses import dataclass

import warp as wp

from ...scene.law import Law, law

SUPPORT = 2.0  # every function here vanishes from r = 2 h on


@dataclass(frozen=True)
class Smoothing:
    """A smoothing function W(r, h) = sigma / h^d w(r / h) in d dimensions.

    ``weight`` is w(q) and ``slope`` is w'(q) / q, which unlike w' needs no division by r for
    grad W = sigma / h^(d + 2) slope(q) x_ij. Both are laws of q, defined for all q >= 0, zero from
    q = 2 on and free of branches, so that loops over them vectorise.
    """

    weight: Law
    slope: Law
    sigma: float


@law
def cubic_spline(q: float):
    """w = (2 - q)^3 / 4 - (1 - q)^3, each power only where its base is positive."""
    outer = wp.max(2.0 - q, 0.0)
    inner = wp.max(1.0 - q, 0.0)
    return 0.25 * outer * outer * outer - inner * inner * inner


@law
def cubic_spline_slope(q: float):
    """w' / q = -3/4 (a + 2b) (1 if q < 1 else a / q), a and b the bases above.

    The factored -3/4 (a^2 - 4 b^2) / q: a - 2b is q itself inside, so nothing cancels near 0.
    """
    outer = wp.max(2.0 - q, 0.0)
    inner = wp.max(1.0 - q, 0.0)
    return -0.75 * (outer + 2.0 * inner) * wp.min(1.0, outer / wp.max(q, 0.5))


@law
def wendland_c2(q: float):
    """w = (1 - q/2)^4 (1 + 2q), in two and three dimensions."""
    s = wp.max(1.0 - 0.5 * q, 0.0)
    return s * s * s * s * (1.0 + 2.0 * q)


@law
def wendland_c2_slope(q: float):
    """w' / q = -5 (1 - q/2)^3."""
    s = wp.max(1.0 - 0.5 * q, 0.0)
    return -5.0 * s * s * s


@law
def wendland_c2_line(q: float):
    """w = (1 - q/2)^3 (1 + 3q/2), Wendland's function of that smoothness in one dimension."""
    s = wp.max(1.0 - 0.5 * q, 0.0)
    return s * s * s * (1.0 + 1.5 * q)


@law
def wendland_c2_line_slope(q: float):
    """w' / q = -3 (1 - q/2)^2."""
    s = wp.max(1.0 - 0.5 * q, 0.0)
    return -3.0 * s * s


_CUBIC = (cubic_spline, cubic_spline_slope)
_WENDLAND = (wendland_c2, wendland_c2_slope)

# By name and dimension. Cubic spline: Monaghan and Lattanzio 1985.
# Wendland C2: Wendland 1995; Dehnen and Aly 2012, table 1, with their H = 2 h.
SMOOTHING: dict[str, dict[int, Smoothing]] = {
    "cubic_spline": {
        1: Smoothing(*_CUBIC, 2.0 / 3.0),
        2: Smoothing(*_CUBIC, 10.0 / (7.0 * math.pi)),
        3: Smoothing(*_CUBIC, 1.0 / math.pi),
    },
    "wendland_c2": {
        1: Smoothing(wendland_c2_line, wendland_c2_line_slope, 5.0 / 8.0),
        2: Smoothing(*_WENDLAND, 7.0 / (4.0 * math.pi)),
        3: Smoothing(*_WENDLAND, 21.0 / (16.0 * math.pi)),
    },
}
