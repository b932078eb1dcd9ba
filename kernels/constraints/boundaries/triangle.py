"""The point of a triangle that is nearest."""

import functools

import warp as wp

from ...precision import Precision, function


@functools.cache
def triangle_function(precision: Precision) -> wp.Function:
    """``nearest(y, a, b, c) -> (q, within)``: the nearest point, and whether it is on no side.

    By the region of the plane that y stands over (Ericson 2005, Real-Time Collision Detection,
    sec. 5.1.5).
    """
    vec3, real = precision.vec3, precision.scalar

    def nearest_of_triangle(y: vec3, a: vec3, b: vec3, c: vec3):
        zero = real(0.0)
        ab = b - a
        ac = c - a
        d1 = wp.dot(ab, y - a)
        d2 = wp.dot(ac, y - a)
        d3 = wp.dot(ab, y - b)
        d4 = wp.dot(ac, y - b)
        d5 = wp.dot(ab, y - c)
        d6 = wp.dot(ac, y - c)
        va = d3 * d6 - d5 * d4
        vb = d5 * d2 - d1 * d6
        vc = d1 * d4 - d3 * d2
        within = int(0)
        q = a
        if d1 <= zero and d2 <= zero:
            q = a
        elif d3 >= zero and d4 <= d3:
            q = b
        elif d6 >= zero and d5 <= d6:
            q = c
        elif vc <= zero and d1 >= zero and d3 <= zero:
            q = a + ab * (d1 / (d1 - d3))
        elif vb <= zero and d2 >= zero and d6 <= zero:
            q = a + ac * (d2 / (d2 - d6))
        elif va <= zero and d4 >= d3 and d5 >= d6:
            q = b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)))
        else:
            within = int(1)
            total = va + vb + vc
            q = a + ab * (vb / total) + ac * (vc / total)
        return q, within

    return function(nearest_of_triangle)
