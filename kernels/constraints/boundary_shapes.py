"""Surfaces of boundaries: how far, and along which normals, a particle is to be brought back.

A surface is a Warp function ``sides(x, e, R, slack, p) -> (back, N)``: of a particle of radius R at
x + e (e is small, and may be what rounding keeps from x) the way back to each side, at least 0, and
the unit normals of the sides, (sides, 3), towards where particles may be. ``slack`` forgives an
overlap on each side; ``p`` are the surface's parameters. Where there is no room for the particle,
the middle is right.
"""

import functools
from typing import Any

import numpy as np
import warp as wp

from ..precision import FLOAT64, Precision, function, function_from_source, register

UNIT = 1.0e-3  # a gradient whose length is farther from 1 is not that of a distance
ASIDE = 32.0  # roundings of a place, from which a gradient is taken once more
ROUNDS = 64  # of Newton's steps; from a vanishing gradient the first goes far, and each halves it


def normals_type(precision: Precision, sides: int) -> Any:
    """One normal for each side."""
    return wp.types.matrix(shape=(sides, 3), dtype=precision.scalar)


@functools.cache
def measure_function(
    law: wp.Function, names: tuple[str, ...], precision: Precision, params: Any
) -> wp.Function:
    """``measure(x, p) -> (d, g)``: a law's value at x, and its gradient by ``wp.grad``."""
    call = ", ".join(["x", *(f"p.{name}" for name in names)])
    derivatives = ", ".join(["g", *(f"unused{n}" for n in range(len(names)))])
    source = (
        "def measure(x: Vec3, p: Params):\n"
        f"    {derivatives} = wp.grad(law)({call})\n"
        f"    return law({call}), g\n"
    )
    namespace = {"wp": wp, "law": law, "Vec3": precision.vec3, "Params": params}
    return function_from_source(source, namespace)


@functools.cache
def distance_function(
    law: wp.Function, names: tuple[str, ...], precision: Precision, params: Any
) -> wp.Function:
    """A law d(x), positive where particles may be: the distance from where it is 0 is R or more.

    Where the gradient has unit length that distance is d itself. A gradient of another length may
    be none, as that of the distance from a line on the line: it is taken once more next to x, and
    the longer one holds. If that is no unit vector either, the distance is the way along it to
    where d is 0, d / |grad d| to first order. Where there is no gradient at all, the direction is
    fixed. What is no number makes none of the particle, for the watchdog to find.
    """
    vec3, real = precision.vec3, precision.scalar
    each, normals = precision.vector(1), normals_type(precision, 1)
    measure = measure_function(law, names, precision, params)
    rounding = ASIDE * float(np.finfo(precision.numpy).eps)

    def way_out(y: vec3, n: vec3, d: real, p: params):
        """The way back along n to where the law is 0, by Newton's steps from d."""
        for _k in range(ROUNDS):
            value, g = measure(y - n * d, p)
            slope = wp.dot(g, n)
            if not slope > real(0.0):
                break
            step = value / slope
            d = d + step
            if not wp.abs(step) > real(rounding) * (wp.abs(d) + wp.max(wp.abs(y))):
                break
        return d

    way = function(way_out, after_gradients=True)

    def distance_sides(x: vec3, e: vec3, R: real, slack: each, p: params):
        y = x + e
        d, g = measure(y, p)
        steep = wp.length(g)
        if not wp.abs(steep - real(1.0)) < real(UNIT):
            near = real(rounding) * (wp.max(wp.abs(y)) + wp.abs(d) + R)
            _d, other = measure(y + vec3(real(0.48), real(0.6), real(0.64)) * near, p)
            if not wp.length(other) < (real(1.0) + real(UNIT)) * steep:
                g = other
                steep = wp.length(g)
        n = vec3(real(0.0), real(1.0), real(0.0))
        if steep > real(0.0):
            n = g / steep
            d = d / steep
        if d < R and not wp.abs(steep - real(1.0)) < real(UNIT):
            d = way(y, n, d, p)
        back = wp.max(R - slack[0] - (d + wp.dot(n, e - (y - x))), real(0.0))
        if wp.isnan(d):
            back = real(1.0)
            n = vec3(d)
        N = normals()
        N[0] = n
        return each(back), N

    # Emitted behind the gradient.
    return function(distance_sides, after_gradients=True)


@functools.cache
def distance_kernel(law: wp.Function, names: tuple[str, ...], params: Any) -> wp.Kernel:
    """Kernel: a signed distance at given points, in double precision."""
    measure = measure_function(law, names, FLOAT64, params)

    @functools.partial(register, cpu_only=True)
    def measure_distances(
        p: params, x: wp.array(dtype=wp.vec3d), d_out: wp.array(dtype=wp.float64)
    ):
        k = wp.tid()
        d, _g = measure(x[k], p)
        d_out[k] = d

    return measure_distances


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
