"""Surfaces of triangles, by ``wp.Mesh``.

Warp's meshes are of single precision: this one is relative to its middle, in units of its size, and
only finds the triangle and the side. The distance is that from the triangle in the simulation's own
precision.
"""

import functools
from typing import Any

import warp as wp

from ...precision import Precision, function
from .triangle import triangle_function

ON = 1.0e-3  # of how far it was, below which a place is on the surface, and rounding is its side


@functools.cache
def corners_function(precision: Precision, params: Any) -> wp.Function:
    """``corners(face, p) -> (a, b, c, n)``: of a triangle, and its unit normal."""

    def corners(face: int, p: params):
        a = p.points[p.corners[3 * face]]
        b = p.points[p.corners[3 * face + 1]]
        c = p.points[p.corners[3 * face + 2]]
        return a, b, c, wp.normalize(wp.cross(b - a, c - a))

    return function(corners)


@functools.cache
def crossed_function(precision: Precision, params: Any) -> wp.Function:
    """``crossed(z, y, p) -> (face, n)``: which triangle lies between, and its side towards z.

    None is -1. Of a closed mesh only what leads out of where particles may be counts.
    """
    vec3, real = precision.vec3, precision.scalar
    corners = corners_function(precision, params)

    def crossed(z: vec3, y: vec3, p: params):
        u = y - z
        way = wp.length(u)
        face = int(-1)
        n = vec3()
        if way > real(0.0):
            start = wp.vec3(z * p.inverse_unit)
            ray = wp.mesh_query_ray(p.mesh, start, wp.vec3(u / way), float(way * p.inverse_unit))
            if ray.result:
                _a, _b, _c, n = corners(ray.face, p)
                if p.sheet != 0:
                    n = n * wp.where(wp.dot(u, n) > real(0.0), real(-1.0), real(1.0))
                elif p.inside != 0:
                    n = -n
                if wp.dot(u, n) < real(0.0):
                    face = ray.face
        return face, n

    return function(crossed)


@functools.cache
def apart_function(precision: Precision, params: Any) -> wp.Function:
    """``apart(y, p)``: how far y is at least from the box around the mesh."""
    vec3, real = precision.vec3, precision.scalar

    def apart(y: vec3, p: params):
        gap = real(0.0)
        for k in range(3):
            gap = wp.max(gap, wp.abs(y[k]) - p.size[k])
        return gap

    return function(apart)


@functools.cache
def found_function(precision: Precision, params: Any) -> wp.Function:
    """``found(y, reach, deep, p) -> (face, outer)``: the nearest triangle, -1 if none is in reach.

    ``outer`` is 1 where particles may be, and else -1. By the winding number that is known however
    ``deep`` the place is, and costs ten times as much as by the normals of what is near.
    """
    vec3, real = precision.vec3, precision.scalar

    def found(y: vec3, reach: real, deep: bool, p: params):
        at = wp.vec3(y * p.inverse_unit)
        # A little farther, as single precision may see it farther off.
        limit = wp.min(reach * p.inverse_unit * real(1.001), real(1.0e6))
        far = float(limit) + 1.0e-6
        face = int(-1)
        outer = real(1.0)
        if p.sheet != 0:
            near = wp.mesh_query_point_no_sign(p.mesh, at, far)
            if near.result:
                face = near.face
        elif deep:
            wound = wp.mesh_query_point_sign_winding_number(p.mesh, at, 1.0e6)
            if wound.result:
                face = wound.face
                outer = real(wound.sign)
        else:
            signed = wp.mesh_query_point_sign_normal(p.mesh, at, far)
            if signed.result:
                face = signed.face
                outer = real(signed.sign)
        if p.inside != 0:
            outer = -outer
        return face, outer

    return function(found)


@functools.cache
def side_function(precision: Precision, params: Any) -> wp.Function:
    """``side(face, outer, y, z, p) -> (d, n)``: the distance of y, which came from z."""
    vec3, real = precision.vec3, precision.scalar
    corners, nearest = corners_function(precision, params), triangle_function(precision)

    def side(face: int, outer: real, y: vec3, z: vec3, p: params):
        a, b, c, n = corners(face, p)
        q, within = nearest(y, a, b, c)
        r = wp.length(y - q)
        if p.sheet != 0:
            ahead = wp.dot(y - q, n)
            before = wp.dot(z - q, n)
            if wp.abs(ahead) < real(wp.static(ON)) * wp.abs(before):
                ahead = before
            n = n * wp.where(ahead < real(0.0), real(-1.0), real(1.0))
        elif p.inside != 0:
            n = -n
        d = wp.dot(y - q, n)
        if within == 0 and r > real(wp.static(ON)) * wp.length(z - q):
            n = (y - q) * (outer / r)
            d = outer * r
        return d, n

    return function(side)


@functools.cache
def mesh_near(precision: Precision, params: Any) -> wp.Function:
    """The distance from a closed mesh, or from both sides of a sheet, less its thickness.

    What has gone through it since the substep began is behind the triangle that it went through.
    """
    vec3, real = precision.vec3, precision.scalar
    corners, crossed = corners_function(precision, params), crossed_function(precision, params)
    apart, found = apart_function(precision, params), found_function(precision, params)
    side = side_function(precision, params)

    def near_mesh(x: vec3, e: vec3, R: real, s: vec3, p: params):
        y = x - p.center + e
        z = s - p.center
        # Twice as far, so that what has just been let go of is still seen.
        way = wp.length(y - z)
        reach = real(2.0) * wp.max(wp.abs(R) + p.thickness, way)
        gap = apart(y, p)
        n = vec3(real(0.0), real(1.0), real(0.0))
        d = gap
        if gap <= reach or p.inside != 0:
            # What has gone nowhere may be anywhere, and what is in the solid from the start has an
            # R below 0; all else can be in the solid by the way of a substep alone.
            deep = way == real(0.0) or R < real(0.0)
            face, outer = found(y, reach, deep, p)
            d = reach
            if face >= 0:
                d, n = side(face, outer, y, z, p)
                behind, across = crossed(z, y, p)
                if behind >= 0:
                    a, _b, _c, _m = corners(behind, p)
                    n = across
                    d = wp.dot(y - a, n)
        return d - p.thickness, n

    return function(near_mesh)
