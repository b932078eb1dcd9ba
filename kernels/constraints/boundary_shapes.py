"""Surfaces of boundaries: how far, and along which normals, a particle is to be brought back.

A surface is a Warp function ``sides(x, e, R, slack, p) -> (back, N)``: of a particle of radius R at
x + e (e is small, and may be what rounding keeps from x) the way back to each side, at least 0, and
the unit normals of the sides, (sides, 3), towards where particles may be. ``slack`` forgives an
overlap on each side; ``p`` are the surface's parameters. Where there is no room for the particle,
the middle is right.
"""

import functools
from typing import Any

import warp as wp

from ..precision import Precision, function


def normals_type(precision: Precision, sides: int) -> Any:
    """One normal for each side."""
    return wp.types.matrix(shape=(sides, 3), dtype=precision.scalar)


@functools.cache
def plane_function(precision: Precision, params: Any) -> wp.Function:
    """The half space (x - point) . n >= R."""
    vec3, real = precision.vec3, precision.scalar
    each, normals = precision.vector(1), normals_type(precision, 1)

    def plane_sides(x: vec3, e: vec3, R: real, slack: each, p: params):
        d = x - p.point + e
        back = wp.max(R - slack[0] - wp.dot(d, p.normal), real(0.0))
        N = normals()
        N[0] = p.normal
        return each(back), N

    return function(plane_sides)


@functools.cache
def sphere_function(precision: Precision, params: Any) -> wp.Function:
    """The inside of a sphere, |x - center| <= radius - R, or its outside, >= radius + R."""
    vec3, real = precision.vec3, precision.scalar
    each, normals = precision.vector(1), normals_type(precision, 1)

    def sphere_sides(x: vec3, e: vec3, R: real, slack: each, p: params):
        d = x - p.center + e
        r = wp.length(d)
        n = vec3(real(0.0), real(1.0), real(0.0))  # of the middle: any direction will do
        if r > real(0.0):
            n = d / r
        back = p.radius + R - slack[0] - r
        if p.inside != 0:
            n = -n
            back = r - (wp.max(p.radius - R, real(0.0)) + slack[0])
        N = normals()
        N[0] = n
        return each(wp.max(back, real(0.0))), N

    return function(sphere_sides)


@functools.cache
def box_function(precision: Precision, params: Any) -> wp.Function:
    """The inside of a box, lower + R <= x <= upper - R; infinite sides are open."""
    vec3, real = precision.vec3, precision.scalar
    each, normals = precision.vector(3), normals_type(precision, 3)

    def outside(x: real, e: real, lower: real, upper: real, radius: real, slack: real):
        """Way back between the two sides of an axis."""
        first = lower + radius
        last = upper - radius
        if first > last:
            first = real(0.5) * (lower + upper)
            last = first
        low = (first - slack - x) - e
        high = (last + slack - x) - e
        return wp.max(low, real(0.0)) + wp.min(high, real(0.0))

    way_back = function(outside)

    def box_sides(x: vec3, e: vec3, R: real, slack: each, p: params):
        back = each()
        N = normals()
        for a in range(3):
            way = way_back(x[a], e[a], p.lower[a], p.upper[a], R, slack[a])
            back[a] = wp.abs(way)
            N[a, a] = wp.where(way < real(0.0), real(-1.0), real(1.0))
        return back, N

    return function(box_sides)
