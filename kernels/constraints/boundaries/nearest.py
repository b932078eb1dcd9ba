"""Surfaces from one function, ``near(x, e, R, s, p) -> (d, n)``.

Of the place x + e it gives the signed distance from the surface, positive where particles may be,
and the unit normal there, towards where they may be. Both are right where d is below R, and else d
is at least R. s is where the substep began, for surfaces that look at the way since; ``p.room`` is
the largest radius for which there is room.
"""

import functools
from types import SimpleNamespace
from typing import Any

import warp as wp

from ...precision import FLOAT64, Precision, function, register
from ..boundary_shapes import normals_type

OPPOSITE = -0.9  # cosine of normals, below which two sides face each other
FAR = 1.0e30  # asks for the distance wherever it is


@functools.cache
def round_functions(precision: Precision) -> SimpleNamespace:
    """- ``away(y, other)``: the length of y and its direction; where there is none, another one;
    - ``turned(d, n, inside)``: a distance and a normal, of the inside both the other way.
    """
    vec3, real = precision.vec3, precision.scalar

    def away(y: vec3, other: vec3):
        r = wp.length(y)
        n = other
        if r > real(0.0):
            n = y / r
        return r, n

    def turned(d: real, n: vec3, inside: int):
        if inside != 0:
            n = -n
            d = -d
        return d, n

    return SimpleNamespace(away=function(away), turned=function(turned))


@functools.cache
def nearest_sides(
    near: wp.Function, sides: int, tracked: bool, precision: Precision, params: Any
) -> wp.Function:
    """``sides(x, e, R, slack, p) -> (back, N)``: onto the nearest point, then the next ones.

    What has been brought back from one part of the surface may still be in another, as in a corner:
    it is brought back from that too, up to ``sides`` times. The slack is that of the first. Where
    it is ``tracked`` s comes before p.
    """
    vec3, real = precision.vec3, precision.scalar
    each, normals = precision.vector(sides), normals_type(precision, sides)

    def nearest(x: vec3, e: vec3, R: real, slack: each, s: vec3, p: params):
        reach = wp.min(R, p.room) - slack[0]
        back = each()
        N = normals()
        at = e
        going = bool(True)
        for a in range(wp.static(sides)):
            if going:
                d, n = near(x, at, reach, s, p)
                way = wp.max(reach - d, real(0.0))
                if wp.isnan(d):  # none of the particle, for the watchdog to find
                    way = real(1.0)
                    n = vec3(d)
                going = way > real(0.0)
                if wp.static(a > 0):
                    # Between two sides without room for it the middle is right.
                    if wp.dot(n, N[wp.static(max(a - 1, 0))]) < real(wp.static(OPPOSITE)):
                        way = real(0.5) * way
                        going = False
                back[a] = way
                N[a] = n
                at = at + n * way
            else:
                N[a] = N[wp.max(a - 1, 0)]
        return back, N

    onto = function(nearest)
    if tracked:
        return onto

    def untracked(x: vec3, e: vec3, R: real, slack: each, p: params):
        return onto(x, e, R, slack, x, p)

    return function(untracked)


@functools.cache
def nearest_facing(near: wp.Function, precision: Precision, params: Any) -> wp.Function:
    """``facing(x, p) -> (d, N)`` (see ``walls``)."""
    vec3, real = precision.vec3, precision.scalar
    each, normals = precision.vector(1), normals_type(precision, 1)

    def facing_nearest(x: vec3, p: params):
        d, n = near(x, vec3(), real(wp.static(FAR)), x, p)
        N = normals()
        N[0] = n
        return each(d), N

    return function(facing_nearest)


@functools.cache
def nearest_kernel(near: wp.Function, params: Any) -> wp.Kernel:
    """Kernel: the distance at given points, in double precision."""
    precision = FLOAT64
    vec3, real = precision.vec3, precision.scalar

    @functools.partial(register, cpu_only=True)
    def measure_nearest(
        parameters: wp.array(dtype=params), x: wp.array(dtype=vec3), d_out: wp.array(dtype=real)
    ):
        k = wp.tid()
        p = parameters[0]
        d, _n = near(x[k], vec3(), real(wp.static(FAR)), x[k], p)
        d_out[k] = d

    return measure_nearest
