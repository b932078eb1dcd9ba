"""Splines: smoothing functions of pieces, after Schoenberg (1946)."""

from __future__ import annotations

import math
from types import MappingProxyType

import warp as wp

from ....scene.law import law
from .smoothing_function import SmoothingFunction


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
def cubic_spline_curvature(q: float):
    """w'' = 3/2 (2 - q) - 6 (1 - q)."""
    return 1.5 * wp.max(2.0 - q, 0.0) - 6.0 * wp.max(1.0 - q, 0.0)


class CubicSpline(SmoothingFunction):
    """The cubic spline, w = (2 - q)^3 / 4 - (1 - q)^3, with support 2 h.

    (Monaghan and Lattanzio 1985.) The usual one: at 1.2 to 1.3 spacings the density of a cubic
    lattice is right to 0.3 %. With many more neighbours particles find together in pairs.

    Example:
        >>> CubicSpline().value([0.0, 1.0, 2.0], dimension=1).round(4).tolist()
        [0.6667, 0.1667, 0.0]
    """

    weight, slope, curvature = cubic_spline, cubic_spline_slope, cubic_spline_curvature
    sigma = MappingProxyType({1: 2.0 / 3.0, 2: 10.0 / (7.0 * math.pi), 3: 1.0 / math.pi})


@law
def quintic_spline(q: float):
    """w = (3 - q)^5 - 6 (2 - q)^5 + 15 (1 - q)^5, each power only where its base is positive."""
    a = wp.max(3.0 - q, 0.0)
    b = wp.max(2.0 - q, 0.0)
    c = wp.max(1.0 - q, 0.0)
    a2 = a * a
    b2 = b * b
    c2 = c * c
    return a2 * a2 * a - 6.0 * b2 * b2 * b + 15.0 * c2 * c2 * c


@law
def quintic_spline_slope(q: float):
    """w' / q = -5 ((3 - q)^4 - 6 (2 - q)^4 + 15 (1 - q)^4) / q.

    In which q < 1 leaves -120 + 120 q^2 - 50 q^3: written so, nothing cancels near 0.
    """
    a = wp.max(3.0 - q, 0.0)
    b = wp.max(2.0 - q, 0.0)
    a2 = a * a
    b2 = b * b
    outer = -5.0 * (a2 * a2 - 6.0 * b2 * b2) / wp.max(q, 1.0)
    return wp.where(q < 1.0, -120.0 + q * q * (120.0 - 50.0 * q), outer)


@law
def quintic_spline_curvature(q: float):
    """w'' = 20 ((3 - q)^3 - 6 (2 - q)^3 + 15 (1 - q)^3)."""
    a = wp.max(3.0 - q, 0.0)
    b = wp.max(2.0 - q, 0.0)
    c = wp.max(1.0 - q, 0.0)
    return 20.0 * (a * a * a - 6.0 * b * b * b + 15.0 * c * c * c)


class QuinticSpline(SmoothingFunction):
    """The quintic spline, w = (3 - q)^5 - 6 (2 - q)^5 + 15 (1 - q)^5, with support 3 h.

    (Morris 1996.) Nearer to a Gaussian than the cubic one: the density of a cubic lattice is right
    to 0.02 % from an h of one spacing on, for 3.4 times the neighbours in three dimensions.

    Example:
        >>> QuinticSpline().in_dimension(1).support
        3.0
    """

    weight, slope, curvature = quintic_spline, quintic_spline_slope, quintic_spline_curvature
    support = 3.0
    center = 66.0
    sigma = MappingProxyType({1: 1 / 120, 2: 7 / (478 * math.pi), 3: 1 / (120 * math.pi)})
