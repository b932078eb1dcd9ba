"""The nearest points of planes, spheres, boxes and laws (see ``nearest``), for combinations."""

import functools
from typing import Any

import warp as wp

from ...precision import Precision, function
from ..boundary_shapes import measure_function
from .nearest import round_functions


@functools.cache
def law_near(
    law: wp.Function, names: tuple[str, ...], precision: Precision, params: Any
) -> wp.Function:
    """A law over the length of its gradient: to first order the distance."""
    vec3, real = precision.vec3, precision.scalar
    measure = measure_function(law, names, precision, params)

    def near_law(x: vec3, e: vec3, R: real, s: vec3, p: params):
        d, g = measure(x + e, p)
        steep = wp.length(g)
        n = vec3(real(0.0), real(1.0), real(0.0))
        if steep > real(0.0):
            n = g / steep
            d = d / steep
        return d, n

    return function(near_law, after_gradients=True)


@functools.cache
def plane_near(precision: Precision, params: Any) -> wp.Function:
    """(x - point) . n."""
    vec3, real = precision.vec3, precision.scalar

    def near_plane(x: vec3, e: vec3, R: real, s: vec3, p: params):
        return wp.dot(x - p.point + e, p.normal), p.normal

    return function(near_plane)


@functools.cache
def sphere_near(precision: Precision, params: Any) -> wp.Function:
    """|x - center| - radius, or from the inside its opposite."""
    vec3, real, own = precision.vec3, precision.scalar, round_functions(precision)
    away, turned = own.away, own.turned

    def near_sphere(x: vec3, e: vec3, R: real, s: vec3, p: params):
        # Of the middle any direction will do.
        r, n = away(x - p.center + e, vec3(real(0.0), real(1.0), real(0.0)))
        return turned(r - p.radius, n, p.inside)

    return function(near_sphere)


@functools.cache
def box_near(precision: Precision, params: Any) -> wp.Function:
    """The distance from the nearest side of a box; outside, less that from its nearest point."""
    vec3, real = precision.vec3, precision.scalar

    def near_box(x: vec3, e: vec3, R: real, s: vec3, p: params):
        n = vec3(real(0.0), real(1.0), real(0.0))
        out = vec3()
        d = real(0.0)
        first = bool(True)
        for a in range(3):
            low = x[a] - p.lower[a] + e[a]
            high = p.upper[a] - x[a] - e[a]
            out[a] = wp.max(-low, real(0.0)) - wp.max(-high, real(0.0))
            nearer = wp.min(low, high)
            if first or nearer < d:
                first = False
                d = nearer
                n = vec3()
                n[a] = wp.where(low < high, real(1.0), real(-1.0))
        beyond = wp.length(out)
        if beyond > real(0.0):
            d = -beyond
            n = out / beyond
        return d, n

    return function(near_box)
