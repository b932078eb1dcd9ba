"""Contacts of particles: a sweep over the pairs that touch in a substep.

Sweeps are Jacobi: a thread reads what the sweep began with and writes its own particle, whatever
the order of the threads. Averaging is by mass splitting (Tonge, Benevolenski and Voroshilov 2012):
a particle with n contacts counts as n times as light in each, which keeps corrections opposite and
equal. Instead of n, the largest eigenvalue of the sum of n n^T over the normals is enough for
corrections that never overshoot (the sum of lam n is then bounded by what is split); it is n for
contacts in a line and n/3 for contacts all around.
"""

import functools
from typing import Any

import numpy as np
import warp as wp

from ..engine.loops import Pairs
from ..precision import Precision, function, register
from .constraints import bodies_type, place_function, rounding_function
from .contact import entry_type, touching_type

SETTLED = 1e-6  # parts of its way that a bounce may be short of
CALM = 0.05  # and parts of the way up to which what forces push rests
ROUNDINGS = 8.0  # and of the distance of a pair


def largest_eigenvalue(precision: Precision) -> wp.Function:
    """An upper bound of the largest eigenvalue of a positive symmetric matrix of six entries.

    (sum lambda^8)^(1/8), by squaring twice: exact for one direction, at most 15 % too much.
    """
    real, six = precision.scalar, precision.vector(6)

    def squared(t: six):
        return six(
            t[0] * t[0] + t[1] * t[1] + t[2] * t[2],
            t[0] * t[1] + t[1] * t[3] + t[2] * t[4],
            t[0] * t[2] + t[1] * t[4] + t[2] * t[5],
            t[1] * t[1] + t[3] * t[3] + t[4] * t[4],
            t[1] * t[2] + t[3] * t[4] + t[4] * t[5],
            t[2] * t[2] + t[4] * t[4] + t[5] * t[5],
        )

    square = function(squared)

    def bound(t: six):
        trace = t[0] + t[3] + t[5]
        q = square(square(t * (real(1.0) / wp.where(trace > real(0.0), trace, real(1.0)))))
        off = q[1] * q[1] + q[2] * q[2] + q[4] * q[4]
        norm = q[0] * q[0] + q[3] * q[3] + q[5] * q[5] + real(2.0) * off
        return trace * wp.sqrt(wp.sqrt(wp.sqrt(norm)))

    return function(bound)


@functools.cache
def _missing_function(precision: Precision) -> wp.Function:
    """``missing(e, u)``: how far an entry's pair is short of its distance on its way u.

    A bounce sends it off along the direction of the start, by e times the way it came. What keeps
    its distance, and has not pushed, is short of nothing: -1.
    """
    vec3, real, Entry = precision.vec3, precision.scalar, entry_type(precision)

    def missing(e: Entry, u: vec3):
        reach, y = e.reach, e.x_ij + u
        along = wp.dot(e.n, y)
        r2 = wp.dot(y, y)
        lack = real(-1.0)
        if r2 < reach * reach or along < real(0.0) or e.rise > real(0.0) or e.lam > real(0.0):
            r = wp.sqrt(r2)
            # Past the middle the distance is no measure.
            lack = reach - wp.where(along < real(0.5) * r, along, r)
            if e.rise > real(0.0):
                lack = wp.max(reach - wp.dot(e.n, e.x_ij), e.rise) - wp.dot(e.n, u)
        return lack

    return function(missing)


@functools.cache
def _stirred_function(precision: Precision) -> wp.Function:
    """``stirred(s, row, count, again, t)``: whether the particle of slot s has part in a sweep.

    All have in those of an iteration; ``again`` those alone that a bounce stirs, and who touches
    them.
    """
    real, Touching = precision.scalar, touching_type(precision)

    def stirred(s: int, row: wp.int64, count: int, again: int, t: Touching):
        if again == 0 or t.stir[s] > real(0.0):
            return True
        for k in range(count):
            if t.stir[t.entry[row + wp.int64(k)].partner] > real(0.0):
                return True
        return False

    return function(stirred)


@functools.cache
def crowding_kernel(precision: Precision, params: Any) -> wp.Kernel:
    """Kernel: w times the ways in which normals are split, and friction.

    Energy cannot grow if in no direction more than the whole of an error is taken back, for a
    share of crowding / split_normal by normals and (n - crowding) / split_friction by friction.
    Without friction that is split_normal = crowding. With friction and a = 1 - crowding / n, 0 for
    contacts in a line and 2/3 all around, split_friction = n / (1 - 3/4 a) leaves normals
    crowding / (1 - a + 3/4 a^2): exact for contacts in a line, even-handed all around.
    """
    real, six = precision.scalar, precision.vector(6)
    Bodies, Touching = bodies_type(precision), touching_type(precision)
    eigenvalue, missing = largest_eigenvalue(precision), _missing_function(precision)
    stirred = _stirred_function(precision)

    @register
    def count_contacts(
        first: int, pairs: Pairs, parameters: wp.array(dtype=params), b: Bodies, again: int,
        t: Touching,
    ):  # fmt: skip
        s = first + wp.tid()
        i = pairs.order[s]
        world = pairs.world[s]
        p = parameters[world]
        count = wp.min(t.found[i], t.room[i])
        begin = t.row[i]
        if count == 0 or t.running[world] == 0 or not stirred(s, begin, count, again, t):
            return
        way_i, total = t.way[s], six()
        for k in range(count):
            at = begin + wp.int64(k)
            e = t.entry[at]
            e.lack = missing(e, way_i - t.way[e.partner])
            t.entry[at] = e
            if e.lack > real(0.0) or e.lam > real(0.0):
                m = e.n
                total += six(
                    m[0] * m[0], m[0] * m[1], m[0] * m[2], m[1] * m[1], m[1] * m[2], m[2] * m[2]
                )
        w = b.w[i] * t.unit / t.relaxation
        crowding = eigenvalue(total)
        split = crowding
        if p.friction > real(0.0):
            n = total[0] + total[3] + total[5]
            a = real(1.0) - crowding / wp.max(n, real(1.0))
            ease = real(0.75) * a
            split = crowding / (real(1.0) - a + a * ease)
            t.grip[s] = w * n / (real(1.0) - ease)
        t.share[s] = w * split

    return count_contacts


def _rubbed_function(precision: Precision) -> wp.Function:
    """``rubbed(e, s, most, t)``: what friction of an entry takes back of the way in all."""
    real, Touching, Entry = precision.scalar, touching_type(precision), entry_type(precision)

    def rubbed(e: Entry, s: int, most: real, t: Touching):
        u, n = t.way[s] - t.way[e.partner], e.n
        rub = e.rub - (u - n * wp.dot(u, n)) / (t.grip[s] + t.grip[e.partner])
        length = wp.length(rub)
        if length > most:
            rub = rub * (most / length)
        return rub

    return function(rubbed)


@functools.cache
def push_kernel(precision: Precision, params: Any, compensated: bool) -> wp.Kernel:
    """Kernel: multipliers of all pairs grow by what is missing, and particles move by w n dlam.

        dlam = (missing - alpha~ lam) / (c_i w_i + c_j w_j + alpha~),    lam >= 0

    along the direction n of the start, c the crowding. Friction takes back the tangential way of
    the substep, split among the contacts too, with at most mu lam in all (Macklin et al. 2014,
    eq. 24).
    """
    vec3, real = precision.vec3, precision.scalar
    Bodies, Touching = bodies_type(precision), touching_type(precision)
    stirred, rubbed = _stirred_function(precision), _rubbed_function(precision)
    tiny = real(ROUNDINGS * float(np.finfo(precision.numpy).eps))
    kept, place = rounding_function(precision, compensated), place_function(precision, compensated)

    @register
    def push_contacts(
        first: int, pairs: Pairs, parameters: wp.array(dtype=params), again: int, t: Touching,
        b: Bodies,
    ):  # fmt: skip
        s = first + wp.tid()
        i = pairs.order[s]
        world, count, begin = pairs.world[s], wp.min(t.found[i], t.room[i]), t.row[i]
        p = parameters[world]
        if count == 0 or t.running[world] == 0 or not stirred(s, begin, count, again, t):
            return
        share_i, stirs = t.share[s], real(0.0)
        alpha = p.compliance * t.inverse_dt * t.unit * t.inverse_dt
        total, w, virial = vec3(), b.w[i] * t.unit, wp.float64(0.0)
        for k in range(count):
            at = begin + wp.int64(k)
            e = t.entry[at]
            j, stir = e.partner, wp.max(t.stir[s], t.stir[e.partner])
            if again != 0 and stir == real(0.0):  # the other one may not look at it
                virial += wp.float64(e.lam * wp.dot(e.n, e.x_ij))
            elif e.lack > real(0.0) or e.lam > real(0.0):
                soft = share_i + t.share[j]
                change = (e.lack - alpha * e.lam) / (soft + alpha)
                more = wp.max(e.lam + change, real(0.0))
                total += e.n * (more - e.lam)
                if stir > real(0.0) and soft > real(0.0):
                    fine = real(SETTLED) * stir + real(CALM) * (t.calm[s] + t.calm[j])
                    fine += tiny * e.reach
                    if wp.abs(e.lack - alpha * more) > fine:
                        stirs = stir
                        t.unsettled[world] = 1
                if p.friction > real(0.0):
                    rub = rubbed(e, s, p.friction * more, t)
                    total += rub - e.rub
                    e.rub = rub
                e.lam = more
                t.entry[at] = e
                virial += wp.float64(more * wp.dot(e.n, e.x_ij))
        t.stirs[s] = stirs
        rate = wp.float64(t.inverse_dt)
        t.virial[i] = virial * rate * rate * wp.float64(t.unit)
        if w > real(0.0):
            place(i, b.x[i], kept(i, b), total * w, b)

    return push_contacts
