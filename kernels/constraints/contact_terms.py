"""Contacts of particles: what pairs add, and what is made of the sums.

The pair passes read copies in slot order and write the state: Jacobi, whatever the order of the
threads. Averaging is by mass splitting (Tonge, Benevolenski and Voroshilov 2012): a particle with
n contacts counts as n times as light in each, which keeps corrections opposite and equal. Instead
of n, the largest eigenvalue of the sum of n n^T over the normals is enough for corrections that
never overshoot (the sum of lam n is then bounded by what is split); it is n for contacts in a line
and n/3 for contacts all around.
"""

from typing import Any

import warp as wp

from ..engine.loops import Term, reader
from ..precision import APART, Precision, function
from .constraints import bodies_type, place_function, rounding_function
from .contact import contact_types


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


def _of_pairs(precision: Precision) -> tuple[wp.Function, wp.Function, wp.Function]:
    """What terms take of a pair: ``apart`` as above; ``both(a, i, j)``, the sum of the two's
    numbers in an array, and ``between(a, i, j)``, the difference of their vectors.
    """
    real, vec3 = precision.scalar, precision.vec3
    number, vector = reader(precision), reader(precision, 3)

    def both(a: wp.array(dtype=real), i: int, j: int):
        return number(a, i) + number(a, j)

    def between(a: wp.array(dtype=vec3), i: int, j: int):
        return vector(a, i) - vector(a, j)

    return apart_function(precision), function(both), function(between)


def crowding_term(precision: Precision, params: Any, bounce: bool) -> Term:
    """Term: n n^T of a pair in contact, as its six entries; bounce: that approached at first."""
    vec3, real, six = precision.vec3, precision.scalar, precision.vector(6)
    (Data, _), (apart, both, between) = contact_types(precision), _of_pairs(precision)

    def crowding(i: int, j: int, x_ij: vec3, r2: real, d: Data, p: params):
        n, n2 = apart(d.slot[i], d.slot[j], x_ij, r2, p.closest_squared)
        reach = both(d.radius, i, j)
        touching = r2 < reach * reach
        if wp.static(bounce):
            touching = touching and wp.dot(n, between(d.way, i, j)) < real(0.0)
        m = n * (wp.where(touching, real(1.0), real(0.0)) / n2)
        return six(m[0] * n[0], m[0] * n[1], m[0] * n[2], m[1] * n[1], m[1] * n[2], m[2] * n[2])

    return Term(function(crowding), 6, rounding=None, placed=False, stored_in_line=True)


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


def contact_term(precision: Precision, params: Any, friction: bool) -> Term:
    """Term: multiplier times direction of a pair's correction, and times its distance.

    lam = (R_i + R_j - r) / (c_i w_i + c_j w_j + alpha~) along the normal, c the crowding; friction
    takes back the tangential way of the substep, split among the contacts too, with at most
    mu lam (Macklin et al. 2014, eq. 24), across the distance.
    """
    vec3, real, four = precision.vec3, precision.scalar, precision.vector(4)
    (Data, _), (apart, both, between) = contact_types(precision), _of_pairs(precision)

    def push(i: int, j: int, x_ij: vec3, r2: real, d: Data, p: params):
        x, x2 = apart(d.slot[i], d.slot[j], x_ij, r2, p.closest_squared)
        reach = both(d.radius, i, j)
        touching = r2 < reach * reach
        u = between(d.way, i, j)
        # A pair that has passed through each other goes back the way it came.
        y = x_ij - u
        y2 = wp.dot(y, y)
        through = wp.dot(y, x_ij) < real(0.0) and y2 > p.closest_squared
        turned = wp.where(through, real(1.0), real(0.0))
        n = x * (real(1.0) - turned) + y * turned
        n = n / wp.sqrt(wp.where(through, y2, x2))
        r = wp.dot(n, x_ij)
        share = both(d.share, i, j)
        soft = share + p.compliance * d.inverse_dt * d.unit * d.inverse_dt
        active = touching and share > real(0.0)
        lam = wp.where(active, reach - r, real(0.0)) / wp.where(active, soft, real(1.0))
        result = n * lam
        if wp.static(friction):
            t = u - n * wp.dot(u, n)
            length = wp.sqrt(wp.dot(t, t))
            split = both(d.grip, i, j)
            split = wp.where(split > real(0.0), split, real(1.0))  # of two pinned ones: nothing
            most = p.friction * lam
            slides = most * split < length
            part = wp.where(slides, most, real(1.0)) / wp.where(slides, length, split)
            result = result - t * part
        return four(result[0], result[1], result[2], lam * r)

    return Term(function(push), 4, rounding=None, placed=False)


def bounce_term(precision: Precision, params: Any) -> Term:
    """Term: impulse that sends a pair off at e times the speed it approached with, and it times r.

    Mueller et al. (2020), eq. 34; the speed is that before the forces of the substep, so that
    what rests under gravity does not bounce.
    """
    vec3, real, four = precision.vec3, precision.scalar, precision.vector(4)
    (Data, _), (apart, both, between) = contact_types(precision), _of_pairs(precision)

    def bounce(i: int, j: int, x_ij: vec3, r2: real, d: Data, p: params):
        n, n2 = apart(d.slot[i], d.slot[j], x_ij, r2, p.closest_squared)
        n = n / wp.sqrt(n2)
        reach = both(d.radius, i, j)
        share = both(d.share, i, j)
        before = wp.dot(between(d.way, i, j), n)
        missing = -p.restitution * before - wp.dot(between(d.v, i, j), n)
        touching = r2 < reach * reach and share > real(0.0)
        hit = touching and before < real(0.0) and missing > real(0.0)
        impulse = wp.where(hit, missing, real(0.0)) / wp.where(hit, share, real(1.0))
        return four(n[0] * impulse, n[1] * impulse, n[2] * impulse, impulse * wp.dot(n, x_ij))

    return Term(function(bounce), 4, rounding=None, placed=False)


def store_share(precision: Precision, params: Any) -> wp.Function:
    """Store: w times the ways in which normals are split, and friction.

    Energy cannot grow if in no direction more than the whole of an error is taken back, for a
    share of crowding / split_normal by normals and (n - crowding) / split_friction by friction.
    Without friction that is split_normal = crowding. With friction and a = 1 - crowding / n, 0 for
    contacts in a line and 2/3 all around, split_friction = n / (1 - 3/4 a) leaves normals
    crowding / (1 - a + 3/4 a^2): exact for contacts in a line, even-handed all around.
    """
    real, six = precision.scalar, precision.vector(6)
    Data, Shares = contact_types(precision)
    eigenvalue = largest_eigenvalue(precision)

    def keep_share(i: int, particle: int, total: six, d: Data, p: params, o: Shares):
        w = o.w[particle] * o.unit / o.relaxation
        crowding = eigenvalue(total)
        split = crowding
        if p.friction > real(0.0):
            n = total[0] + total[3] + total[5]
            a = real(1.0) - crowding / wp.max(n, real(1.0))
            ease = real(0.75) * a
            split = crowding / (real(1.0) - a + a * ease)
            o.grip[i] = w * n / (real(1.0) - ease)
        o.share[i] = w * split

    return function(keep_share)


def store_correction(precision: Precision, params: Any, compensated: bool) -> wp.Function:
    """Store: x += w sum, and the same into the correction; the virial of the multipliers."""
    vec3, real, four = precision.vec3, precision.scalar, precision.vector(4)
    (Data, _), Bodies = contact_types(precision), bodies_type(precision)
    kept, place = rounding_function(precision, compensated), place_function(precision, compensated)

    def correct(i: int, particle: int, total: four, d: Data, p: params, o: Bodies):
        touched = total[0] != real(0.0) or total[1] != real(0.0) or total[2] != real(0.0)
        if touched:
            dx = vec3(total[0], total[1], total[2]) * (o.w[particle] * o.unit)
            place(particle, o.x[particle], kept(particle, o), dx, o)
            rate = wp.float64(d.inverse_dt)
            w = wp.float64(total[3]) * rate * rate * wp.float64(d.unit)
            d.virial[particle] = d.virial[particle] + w

    return function(correct)


def store_impulse(precision: Precision, params: Any) -> wp.Function:
    """Store: v += w sum; the virial of the impulses, over the substep."""
    vec3, four = precision.vec3, precision.vector(4)
    (Data, _), Bodies = contact_types(precision), bodies_type(precision)

    def kick(i: int, particle: int, total: four, d: Data, p: params, o: Bodies):
        impulse = vec3(total[0], total[1], total[2])
        o.v[particle] = o.v[particle] + impulse * (o.w[particle] * o.unit)
        w = wp.float64(total[3]) * wp.float64(d.inverse_dt) * wp.float64(d.unit)
        d.virial[particle] = d.virial[particle] + w

    return function(kick)
