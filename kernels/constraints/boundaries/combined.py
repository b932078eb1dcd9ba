"""Combinations of solids, by the nearest points of their parts (see ``nearest``).

Beside ``near`` each has ``touch(x, e, s, p) -> (mu, e)``: friction and restitution of the part that
is nearest.
"""

import functools
from typing import Any

import warp as wp

from ...precision import Precision, function
from .nearest import FAR


@functools.cache
def own_touch(precision: Precision, params: Any) -> wp.Function:
    """Those of a boundary of one part."""
    vec3 = precision.vec3

    def touch_own(x: vec3, e: vec3, s: vec3, p: params):
        return p.friction, p.restitution

    return function(touch_own)


@functools.cache
def union_near(
    first: wp.Function, second: wp.Function, precision: Precision, params: Any
) -> wp.Function:
    """The nearer of two solids."""
    vec3, real = precision.vec3, precision.scalar

    def near_union(x: vec3, e: vec3, R: real, s: vec3, p: params):
        d, n = first(x, e, R, s, p.first)
        other, m = second(x, e, R, s, p.second)
        if other < d:
            d = other
            n = m
        return d, n

    return function(near_union)


@functools.cache
def union_touch(
    nears: tuple[wp.Function, wp.Function], touches: tuple[wp.Function, wp.Function],
    precision: Precision, params: Any,
) -> wp.Function:  # fmt: skip
    """Those of the nearer of two solids."""
    vec3, real = precision.vec3, precision.scalar
    (first, second), (one, two) = nears, touches

    def touch_union(x: vec3, e: vec3, s: vec3, p: params):
        far = real(wp.static(FAR))
        d, _n = first(x, e, far, s, p.first)
        other, _m = second(x, e, far, s, p.second)
        mu, rest = one(x, e, s, p.first)
        if other < d:
            mu, rest = two(x, e, s, p.second)
        return mu, rest

    return function(touch_union)


@functools.cache
def complement_near(part: wp.Function, precision: Precision, params: Any) -> wp.Function:
    """What the part leaves open is solid, and the part is open."""
    vec3, real = precision.vec3, precision.scalar

    def near_complement(x: vec3, e: vec3, R: real, s: vec3, p: params):
        # A part that looks at the way of a substep would see it from the other side.
        d, n = part(x, e, real(wp.static(FAR)), x, p.part)
        return -d, -n

    return function(near_complement)


@functools.cache
def complement_touch(touch: wp.Function, precision: Precision, params: Any) -> wp.Function:
    """Those of the part."""
    vec3 = precision.vec3

    def touch_complement(x: vec3, e: vec3, s: vec3, p: params):
        mu, rest = touch(x, e, s, p.part)
        return mu, rest

    return function(touch_complement)
