"""Surfaces from values on grids: sampled distances, and heights."""

import functools
from typing import Any

import numpy as np
import warp as wp

from ...precision import Precision, function
from .nearest import FAR
from .triangle import triangle_function

DEEP = 8.0  # cells, as far as the surface is looked for from below, or from far above


@functools.cache
def sampled_near(precision: Precision, params: Any) -> wp.Function:
    """A sampled distance, linear along each axis between the samples, and its gradient.

    Beyond the grid it goes on from the nearest place of it: away from a solid that ends there, and
    deeper into one that does not.
    """
    vec3, real = precision.vec3, precision.scalar

    def near_sampled(x: vec3, e: vec3, R: real, s: vec3, p: params):
        y = x - p.lower + e
        q = y
        for a in range(3):
            q[a] = wp.clamp(y[a], real(0.0), p.size[a])
        t = q * p.inverse
        i = wp.min(int(t[0]), p.values.shape[0] - 2)
        j = wp.min(int(t[1]), p.values.shape[1] - 2)
        k = wp.min(int(t[2]), p.values.shape[2] - 2)
        u = t[0] - real(i)
        v = t[1] - real(j)
        w = t[2] - real(k)
        # By z, then by y, then by x; the differences are those between what is left.
        a00 = p.values[i, j, k]
        a01 = p.values[i, j + 1, k]
        a10 = p.values[i + 1, j, k]
        a11 = p.values[i + 1, j + 1, k]
        b00 = p.values[i, j, k + 1] - a00
        b01 = p.values[i, j + 1, k + 1] - a01
        b10 = p.values[i + 1, j, k + 1] - a10
        b11 = p.values[i + 1, j + 1, k + 1] - a11
        c0 = a00 + b00 * w
        c1 = a10 + b10 * w
        d0 = a01 + b01 * w - c0
        d1 = a11 + b11 * w - c1
        low = c0 + d0 * v
        high = c1 + d1 * v
        d = low + (high - low) * u
        z0 = b00 + (b01 - b00) * v
        z1 = b10 + (b11 - b10) * v
        g = vec3(high - low, d0 + (d1 - d0) * u, z0 + (z1 - z0) * u)
        beyond = wp.length(y - q)
        if beyond > real(0.0):
            side = wp.where(d > real(0.0), real(1.0), real(-1.0))
            g = (y - q) * (side / beyond)
            d = d + side * beyond
        steep = wp.length(g)
        n = vec3(real(0.0), real(1.0), real(0.0))
        if steep > real(0.0):
            n = g / steep
        return d, n

    return function(near_sampled)


@functools.cache
def node_function(precision: Precision, params: Any) -> wp.Function:
    """``node(i, j, p)``: a node of the heights, along both axes and up; those of the edge go on."""
    vec3, real = precision.vec3, precision.scalar

    def node(i: int, j: int, p: params):
        a = wp.clamp(i, 0, p.heights.shape[0] - 1)
        b = wp.clamp(j, 0, p.heights.shape[1] - 1)
        return vec3(real(i) * p.spacing, real(j) * p.spacing, p.heights[a, b])

    return function(node)


@functools.cache
def half_function(precision: Precision, params: Any) -> wp.Function:
    """``half(i, j, upper, p) -> (a, b, c)``: one of both triangles of a cell, upward."""
    node = node_function(precision, params)

    def half(i: int, j: int, upper: int, p: params):
        a = node(i, j, p)
        c = node(i + 1, j + 1, p)
        b = node(i + 1, j, p)
        if upper != 0:
            b = c
            c = node(i, j + 1, p)
        return a, b, c

    return function(half)


@functools.cache
def below_function(precision: Precision, params: Any) -> wp.Function:
    """``below(y, p) -> (gap, n)``: how high y is over the triangle below, and its normal."""
    vec3, real = precision.vec3, precision.scalar
    half = half_function(precision, params)

    def below(y: vec3, p: params):
        u = y[0] * p.inverse
        v = y[1] * p.inverse
        i = int(wp.floor(u))
        j = int(wp.floor(v))
        upper = wp.where(v - real(j) > u - real(i), 1, 0)
        a, b, c = half(i, j, upper, p)
        n = wp.normalize(wp.cross(b - a, c - a))
        return wp.dot(y - a, n) / n[2], n

    return function(below)


@functools.cache
def heights_near(precision: Precision, params: Any) -> wp.Function:
    """The distance from the triangles within reach; from beneath what is up to ``DEEP`` cells.

    What is deeper is as far from the plane of the triangle above, which leads it up.
    """
    vec3, real = precision.vec3, precision.scalar
    half, below = half_function(precision, params), below_function(precision, params)
    nearest = triangle_function(precision)
    far, deep = 0.5 * FAR, float(np.float32(DEEP))

    def near_heights(x: vec3, e: vec3, R: real, s: vec3, p: params):
        place = x - p.lower + e
        y = vec3(place[p.first], place[p.second], place[p.up])
        gap, n = below(y, p)
        d = gap * n[2]  # of the plane
        reach = real(wp.static(deep)) * p.spacing
        if R < real(wp.static(far)):
            # Twice as far, so that what has just been let go of is still seen.
            own = real(2.0) * wp.abs(R)
            reach = wp.where(gap > real(0.0), own, wp.max(own, reach))
            d = wp.where(gap > own, wp.max(d, own), d)
        closest = wp.min(reach, wp.abs(gap))
        side = wp.where(gap < real(0.0), real(-1.0), real(1.0))
        low_i = int(wp.floor((y[0] - closest) * p.inverse))
        low_j = int(wp.floor((y[1] - closest) * p.inverse))
        high_i = int(wp.floor((y[0] + closest) * p.inverse)) + 1
        high_j = int(wp.floor((y[1] + closest) * p.inverse)) + 1
        for i in range(low_i, high_i):
            for j in range(low_j, high_j):
                for upper in range(2):
                    a, b, c = half(i, j, upper, p)
                    q, within = nearest(y, a, b, c)
                    r = wp.length(y - q)
                    if r <= closest:
                        closest = r
                        n = wp.normalize(wp.cross(b - a, c - a))
                        d = wp.dot(y - q, n)
                        if within == 0 and r > real(0.0):
                            d = side * r
                            n = (y - q) * (side / r)
        out = vec3()
        out[p.first] = n[0]
        out[p.second] = n[1]
        out[p.up] = n[2]
        return d, out

    return function(near_heights)
