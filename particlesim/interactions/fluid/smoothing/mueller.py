"""Smoothing functions of Mueller, Charypar and Gross (2003): for pictures in real time."""

from __future__ import annotations

import math
from types import MappingProxyType

import warp as wp

from ....scene.law import law
from .smoothing_function import SmoothingFunction

# Their h is the radius of the support, 2 h here: u = q / 2 is their r / h.


@law
def poly6(q: float):
    """w = (1 - u^2)^3."""
    s = wp.max(1.0 - 0.25 * q * q, 0.0)
    return s * s * s


@law
def poly6_slope(q: float):
    """w' / q = -3/2 (1 - u^2)^2."""
    s = wp.max(1.0 - 0.25 * q * q, 0.0)
    return -1.5 * s * s


@law
def poly6_curvature(q: float):
    """w'' = -3/2 (1 - u^2) (1 - 5 u^2)."""
    s = wp.max(1.0 - 0.25 * q * q, 0.0)
    return -1.5 * s * (1.0 - 1.25 * q * q)


class Poly6(SmoothingFunction):
    """w = (1 - u^2)^3, u = r / 2h, with support 2 h (Mueller 2003, eq. 20).

    Needs no root: for sums that are no derivatives, such as the density. Its gradient is weak near
    the centre, so that under pressure particles come together in clumps: a fluid that is to be
    right takes a spline or one of Wendland's.

    Example:
        >>> round(Poly6().in_dimension(2).sigma, 4)
        0.3183
    """

    weight, slope, curvature = poly6, poly6_slope, poly6_curvature
    sigma = MappingProxyType({1: 35 / 64, 2: 1 / math.pi, 3: 315 / (512 * math.pi)})


@law
def spiky(q: float):
    """w = (1 - u)^3."""
    s = wp.max(1.0 - 0.5 * q, 0.0)
    return s * s * s


@law
def spiky_slope(q: float):
    """w' / q = -3/2 (1 - u)^2 / q, which grows without bound towards the centre."""
    s = wp.max(1.0 - 0.5 * q, 0.0)
    return -1.5 * s * s / wp.max(q, 1.0e-6)


@law
def spiky_curvature(q: float):
    """w'' = 3/2 (1 - u)."""
    return 1.5 * wp.max(1.0 - 0.5 * q, 0.0)


class Spiky(SmoothingFunction):
    """w = (1 - u)^3, u = r / 2h, with support 2 h (Mueller 2003, eq. 21).

    A cusp at the centre: its gradient keeps its size there, so that particles do not come together
    in clumps, and turns at once. The density of a cubic lattice is 8 % too high at an h of 1.3
    spacings, 1.5 % at 2. In more than one dimension its laplacian is infinite at r = 0.

    Example:
        >>> round(Spiky().in_dimension(3).sigma, 4)
        0.5968
    """

    weight, slope, curvature = spiky, spiky_slope, spiky_curvature
    sigma = MappingProxyType({1: 1.0, 2: 5 / (2 * math.pi), 3: 15 / (8 * math.pi)})


@law
def mueller_viscosity(q: float):
    """w = -u^3 / 2 + u^2 + 1 / (2u) - 1."""
    u = 0.5 * q
    return wp.where(q < 2.0, u * u * (1.0 - 0.5 * u) + 0.5 / u - 1.0, 0.0)


@law
def mueller_viscosity_slope(q: float):
    """w' / q = (-3/2 u + 2 - 1 / (2 u^3)) / 4."""
    u = 0.5 * q
    return wp.where(q < 2.0, 0.25 * (2.0 - 1.5 * u - 0.5 / (u * u * u)), 0.0)


@law
def mueller_viscosity_curvature(q: float):
    """w'' = (-3u + 2 + 1 / u^3) / 4."""
    u = 0.5 * q
    return wp.where(q < 2.0, 0.25 * (2.0 - 3.0 * u + 1.0 / (u * u * u)), 0.0)


class MuellerViscosity(SmoothingFunction):
    """w = -u^3 / 2 + u^2 + 1 / (2u) - 1, u = r / 2h, with support 2 h (Mueller 2003, eq. 22).

    Its laplacian in three dimensions is 45 (2h - r) / (pi (2h)^6), positive everywhere: a viscosity
    that sums it takes energy out of any motion. It is infinite at r = 0, so that an ``SPH``, which
    sums densities by it, refuses it; and on a line it has no finite integral.

    Example:
        >>> MuellerViscosity().in_dimension(3).center
        inf
    """

    weight = mueller_viscosity
    slope, curvature = mueller_viscosity_slope, mueller_viscosity_curvature
    center = math.inf
    dimensions = (2, 3)
    sigma = MappingProxyType({2: 5 / (6 * math.pi), 3: 15 / (16 * math.pi)})
