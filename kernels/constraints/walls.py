"""Boundaries as walls: how far the sides of a surface are, and their normals.

Each is a Warp function ``facing(x, p) -> (d, N)`` of a place and the surface's parameters: signed
distances by side, positive where particles may be, and unit normals to there, (sides, 3).
"""

import functools
from typing import Any

import warp as wp

from ..precision import Precision, function
from .boundary_shapes import measure_function, normals_type


@functools.cache
def distance_facing(
    law: wp.Function, names: tuple[str, ...], precision: Precision, params: Any
) -> wp.Function:
    """A law d(x): its value over the length of its gradient, to first order the distance."""
    vec3, real = precision.vec3, precision.scalar
    each, normals = precision.vector(1), normals_type(precision, 1)
    measure = measure_function(law, names, precision, params)

    def law_facing(x: vec3, p: params):
        d, g = measure(x, p)
        steep = wp.length(g)
        N = normals()
        N[0] = vec3(real(0.0), real(1.0), real(0.0))
        if steep > real(0.0):
            N[0] = g / steep
            d = d / steep
        return each(d), N

    return function(law_facing, after_gradients=True)


@functools.cache
def plane_facing(precision: Precision, params: Any) -> wp.Function:
    """(x - point) . n."""
    vec3 = precision.vec3
    each, normals = precision.vector(1), normals_type(precision, 1)

    def facing_plane(x: vec3, p: params):
        N = normals()
        N[0] = p.normal
        return each(wp.dot(x - p.point, p.normal)), N

    return function(facing_plane)


@functools.cache
def sphere_facing(precision: Precision, params: Any) -> wp.Function:
    """|x - center| - radius, or from the inside radius - |x - center|."""
    vec3, real = precision.vec3, precision.scalar
    each, normals = precision.vector(1), normals_type(precision, 1)

    def facing_sphere(x: vec3, p: params):
        d = x - p.center
        r = wp.length(d)
        n = vec3(real(0.0), real(1.0), real(0.0))  # of the middle: any direction will do
        if r > real(0.0):
            n = d / r
        outside = real(1.0) - real(2.0) * real(p.inside)
        N = normals()
        N[0] = n * outside
        return each((r - p.radius) * outside), N

    return function(facing_sphere)


@functools.cache
def box_facing(precision: Precision, params: Any) -> wp.Function:
    """x - lower and upper - x along each axis; infinite sides are infinitely far."""
    vec3, real = precision.vec3, precision.scalar
    each, normals = precision.vector(6), normals_type(precision, 6)

    def facing_box(x: vec3, p: params):
        d = each()
        N = normals()
        for a in range(3):
            d[2 * a] = x[a] - p.lower[a]
            d[2 * a + 1] = p.upper[a] - x[a]
            N[2 * a, a] = real(1.0)
            N[2 * a + 1, a] = real(-1.0)
        return d, N

    return function(facing_box)
