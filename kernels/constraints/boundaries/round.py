"""Surfaces about an axis: capsules and cylinders."""

import functools
from typing import Any

import warp as wp

from ...precision import Precision, function
from ..boundary_shapes import normals_type
from .nearest import round_functions


@functools.cache
def capsule_near(precision: Precision, params: Any) -> wp.Function:
    """The distance from a segment, less the radius."""
    vec3, real, own = precision.vec3, precision.scalar, round_functions(precision)
    away, turned = own.away, own.turned

    def near_capsule(x: vec3, e: vec3, R: real, s: vec3, p: params):
        y = x - p.center + e
        y = y - p.axis * wp.clamp(wp.dot(y, p.axis), -p.half, p.half)
        r, n = away(y, p.aside)  # of the segment: any direction across it will do
        return turned(r - p.radius, n, p.inside)

    return function(near_capsule)


@functools.cache
def cylinder_near(precision: Precision, params: Any) -> wp.Function:
    """The distance from a cylinder, with its edges; of infinite half length from one without."""
    vec3, real, own = precision.vec3, precision.scalar, round_functions(precision)
    away, turned = own.away, own.turned

    def near_cylinder(x: vec3, e: vec3, R: real, s: vec3, p: params):
        y = x - p.center + e
        along = wp.dot(y, p.axis)
        r, out = away(y - p.axis * along, p.aside)  # of the axis: any direction across it will do
        cap = p.axis * wp.where(along < real(0.0), real(-1.0), real(1.0))
        d = r - p.radius
        n = out
        beyond = wp.abs(along) - p.half
        if d > real(0.0) and beyond > real(0.0):
            y = out * d + cap * beyond
            d = wp.length(y)
            n = y / d
        elif beyond > d:
            d = beyond
            n = cap
        return turned(d, n, p.inside)

    return function(near_cylinder)


@functools.cache
def cylinder_facing(precision: Precision, params: Any) -> wp.Function:
    """From the inside the distances of the round side and of both ends (see ``walls``)."""
    vec3, away = precision.vec3, round_functions(precision).away
    each, normals = precision.vector(3), normals_type(precision, 3)

    def facing_cylinder(x: vec3, p: params):
        y = x - p.center
        along = wp.dot(y, p.axis)
        r, out = away(y - p.axis * along, p.aside)  # of the axis: any direction across it will do
        N = normals()
        N[0] = -out
        N[1] = p.axis
        N[2] = -p.axis
        return each(p.radius - r, p.half + along, p.half - along), N

    return function(facing_cylinder)
