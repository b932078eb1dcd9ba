"""Contacts of particles: who touches whom in a substep."""

import functools
from typing import Any

import warp as wp

from ..engine.loops import Pairs, Periodicity, box_type, minimum_image
from ..precision import APART, Precision, function, register
from .constraints import bodies_type
from .contact import MARGIN, entry_type, excludes, touching_type

TOUCH = 1e-4  # parts of the lesser radius: what still counts as touching, where contacts bounce


def apart_function(precision: Precision) -> wp.Function:
    """``apart(a, b, x_ij, r2, closest_squared)``: what a pair is apart by, and its square.

    Coincident particles, of slots a and b, are taken as 1 apart in one of eight directions by the
    difference of their slots: opposite for the two, the same in a batch as alone, and not all in
    one line.
    """
    vec3, real = precision.vec3, precision.scalar
    ax, ay, az = map(precision.scalar, APART)

    def apart(a: int, b: int, x_ij: vec3, r2: real, closest_squared: real):
        k = wp.abs(a - b)
        side = wp.where(a < b, real(-1.0), real(1.0))
        nx = wp.where((k & 1) == 0, ax, -ax)
        ny = wp.where((k & 2) == 0, ay, -ay)
        nz = wp.where((k & 4) == 0, az, -az)
        together = wp.where(r2 > closest_squared, real(0.0), side)
        there = wp.where(r2 > closest_squared, real(1.0), real(0.0))
        x = x_ij * there + vec3(nx, ny, nz) * together
        return x, wp.where(r2 > closest_squared, r2, real(1.0))

    return function(apart)


def _meet_function(precision: Precision) -> wp.Function:
    """``meet(x, u, reach)``: whether what is at x comes so near to 0 on its straight way u."""
    vec3, real = precision.vec3, precision.scalar

    def meet(x: vec3, u: vec3, reach: real):
        close, when = -wp.dot(x, u), real(0.0)
        if close > real(0.0):
            when = wp.min(close / wp.dot(u, u), real(1.0))
        nearest = x + u * when
        return wp.dot(nearest, nearest) < reach * reach

    return function(meet)


def _touches_function(precision: Precision) -> wp.Function:
    """``touches(s, o, x_ij, bounces, dt, t)``: whether two slots touch on the way of a substep, or
    what rests is so near to another that it may be pushed there.
    """
    vec3, real, Touching = precision.vec3, precision.scalar, touching_type(precision)
    near, exactly, meet = real(MARGIN), real(TOUCH), _meet_function(precision)

    def touches(s: int, o: int, x_ij: vec3, bounces: bool, dt: real, t: Touching):
        R_i, R_j = t.radius[s], t.radius[o]
        v, calm = t.v[s] - t.v[o], t.calm[s] + t.calm[o]
        rests = wp.dot(v, v) * dt * dt < calm * calm or not bounces
        touch = R_i + R_j + wp.min(R_i, R_j) * wp.where(rests, near, exactly)
        return meet(x_ij, t.way[s] - t.way[o], touch)

    return function(touches)


@functools.cache
def find_kernel(precision: Precision, periodic: Periodicity, params: Any) -> wp.Kernel:
    """Kernel: the rows of a substep, with multipliers of 0.

    Who touches is found on the straight way of the substep, so that what passes through each other
    is found as well. Of what moves and bounces it is these alone: what they push is met in the next
    substep, when the speed that it came with is known. Of what rests all that are near are found.
    """
    real, Box = precision.scalar, box_type(precision)
    Touching, Bodies = touching_type(precision), bodies_type(precision)
    apart, image = apart_function(precision), minimum_image(precision, periodic)
    touches, Entry = _touches_function(precision), entry_type(precision)

    @register
    def find_contacts(
        first: int, pairs: Pairs, box: wp.array(dtype=Box), parameters: wp.array(dtype=params),
        apart_of: wp.array2d(dtype=wp.int32), b: Bodies, dt: real, t_out: Touching,
    ):  # fmt: skip
        s = first + wp.tid()
        i, w = pairs.order[s], pairs.world[s]
        p, c = parameters[w], pairs.cluster[s]
        begin, room, found = t_out.row[i], t_out.room[i], int(0)
        x_i, span_i, stir = t_out.x[s], t_out.span[s], real(0.0)
        bounces = p.restitution > real(0.0) and dt > real(0.0)
        for k in range(pairs.count[c]):
            other = pairs.index[pairs.row[c] + wp.int64(k) * pairs.entry_stride]
            x_ij = image(x_i - t_out.x[other], box[w])
            span = span_i + t_out.span[other]
            if other == s or wp.dot(x_ij, x_ij) > span * span:
                continue
            j = pairs.order[other]
            if b.w[i] + b.w[j] == real(0.0) or excludes(apart_of, i, j):
                continue
            if touches(s, other, x_ij, bounces, dt, t_out):
                if found < room:
                    v = t_out.v[s] - t_out.v[other]
                    calm = t_out.calm[s] + t_out.calm[other]
                    at = begin + wp.int64(found)
                    d, d2 = apart(s, other, x_ij, wp.dot(x_ij, x_ij), p.closest_squared)
                    n = d / wp.sqrt(d2)
                    e = Entry()
                    e.partner = other
                    e.reach = t_out.radius[s] + t_out.radius[other]
                    e.x_ij = x_ij
                    e.n = n
                    if bounces and -wp.dot(n, v) * dt > calm:
                        e.rise = -p.restitution * wp.dot(n, v) * dt
                        stir = wp.max(stir, -wp.dot(n, v) * dt)
                    t_out.entry[at] = e
                found += 1
        t_out.stir[s] = stir
        t_out.found[i] = found
        t_out.most[i] = wp.max(t_out.most[i], found)
        t_out.virial[i] = wp.float64(0.0)
        if found > room:
            t_out.overflow[0] = 1

    return find_contacts
