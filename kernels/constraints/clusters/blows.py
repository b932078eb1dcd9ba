"""What a joint does to two rigid bodies: pure functions, in float64."""

import warp as wp

from ...precision import function
from .rotation import THIN, spin_of

double = wp.float64


@wp.struct
class Side:
    """A cluster as a rigid body, seen from its own origin."""

    middle: wp.vec3d  # of where members are
    start: wp.vec3d  # of where they were
    R: wp.mat33d  # the rotation that fits best where members are
    R_0: wp.mat33d  # and where they were
    inertia: wp.mat33d  # as they were
    light: wp.float64  # 1 / mass, 0 where it cannot move


@wp.struct
class Blow:
    """What a joint does to its sides: opposite impulses and torques."""

    push: wp.vec3d  # on a, at one place for both
    torque: wp.vec3d  # on a


def _world():
    """What never moves, as a side."""
    s = Side()
    s.R = wp.identity(n=3, dtype=double)
    s.R_0 = wp.identity(n=3, dtype=double)
    return s


world = function(_world)


def _answer(s: Side, torque: wp.vec3d):
    """The turn of a body by a torque about its centre."""
    phi = wp.vec3d()
    if s.light > double(0.0):
        phi = spin_of(torque, s.inertia)
    return phi


answer = function(_answer)


def _pushing(a: Side, b: Side, r_a: wp.vec3d, r_b: wp.vec3d, at_a: wp.vec3d, at_b: wp.vec3d):
    """How the points part, and how the sides turn against each other, by a push at ``at``."""
    K, turn = wp.mat33d(), wp.mat33d()
    for n in range(3):
        e = wp.vec3d()
        e[n] = double(1.0)
        phi_a = answer(a, wp.cross(at_a - a.start, e))
        phi_b = answer(b, wp.cross(at_b - b.start, e))
        way = e * (a.light + b.light) + wp.cross(phi_a, r_a) + wp.cross(phi_b, r_b)
        for m in range(3):
            K[m, n] = way[m]
            turn[m, n] = phi_a[m] + phi_b[m]
    return K, turn


pushing = function(_pushing)


def _turning(a: Side, b: Side, r_a: wp.vec3d, r_b: wp.vec3d):
    """The same by a torque."""
    way, K = wp.mat33d(), wp.mat33d()
    for n in range(3):
        e = wp.vec3d()
        e[n] = double(1.0)
        phi_a, phi_b = answer(a, e), answer(b, e)
        part = wp.cross(phi_a, r_a) + wp.cross(phi_b, r_b)
        for m in range(3):
            way[m, n] = part[m]
            K[m, n] = phi_a[m] + phi_b[m]
    return way, K


turning = function(_turning)


def _crosswise(K: wp.mat33d, u: wp.vec3d, off: wp.vec3d):
    """The torque across u that makes up for ``off`` there; about u it is free."""
    one = wp.identity(n=3, dtype=double)
    across = one - wp.outer(u, u)
    size = wp.trace(K)
    torque = wp.vec3d()
    if size > double(0.0):
        thin = double(wp.static(THIN)) * size * one  # a line is not to be turned about itself
        free = across * K * across + size * wp.outer(u, u) + thin
        torque = wp.inverse(free) * (across * off)
    return torque


crosswise = function(_crosswise)


def _within(
    axis: wp.vec3d, arm: wp.vec3d, stop: wp.vec2d, turned: wp.vec3d, K: wp.mat33d, a: Side,
    b: Side,
):  # fmt: skip
    """The torque that brings axes together and angles within limits.

    Across the axis by u_a x u_b, which turns one to the other, less what they are turned already;
    about it by what is too much. It is along directions as they were: it does no work on what
    turns freely.
    """
    u_a, u_b, v_a, v_b = a.R * axis, b.R * axis, a.R * arm, b.R * arm
    now = wp.normalize(u_a + u_b)
    u = wp.normalize(a.R_0 * axis + b.R_0 * axis)
    angle = wp.atan2(wp.dot(now, wp.cross(v_a, v_b)), wp.dot(v_a, v_b))
    excess = angle - wp.clamp(angle, stop[0], stop[1])
    off = wp.cross(u_a, u_b) - turned
    torque = crosswise(K, u, off)
    if excess != double(0.0):
        one = wp.identity(n=3, dtype=double)
        off = (one - wp.outer(u, u)) * off + u * (excess - wp.dot(u, turned))
        stopped = wp.inverse(K + double(wp.static(THIN)) * wp.trace(K) * one) * off
        if wp.dot(stopped, u) * excess > double(0.0):  # a stop only pushes
            torque = stopped
    return torque


within = function(_within)


def _joined(
    a: Side, b: Side, r_a: wp.vec3d, r_b: wp.vec3d, at_a: wp.vec3d, at_b: wp.vec3d,
    off: wp.vec3d, soft: wp.mat33d,
):  # fmt: skip
    """The push that closes ``off`` between the points of a ball joint."""
    K, _turn = pushing(a, b, r_a, r_b, at_a, at_b)
    return wp.inverse(K + soft) * off


joined = function(_joined)


def _hinged(
    a: Side, b: Side, r_a: wp.vec3d, r_b: wp.vec3d, at_a: wp.vec3d, at_b: wp.vec3d,
    off: wp.vec3d, soft: wp.mat33d, axis: wp.vec3d, arm: wp.vec3d, stop: wp.vec2d,
):  # fmt: skip
    """Push and torque of a hinge, which hold points and axis at once (Schur's complement)."""
    K, turn = pushing(a, b, r_a, r_b, at_a, at_b)
    way, spread = turning(a, b, r_a, r_b)
    inverse = wp.inverse(K + soft)
    blow = Blow()
    blow.push = inverse * off
    held = spread - turn * inverse * way
    blow.torque = within(axis, arm, stop, turn * blow.push, held, a, b)
    blow.push = blow.push - inverse * (way * blow.torque)
    return blow


hinged = function(_hinged)


def _struck(
    a: Side, b: Side, r_a: wp.vec3d, r_b: wp.vec3d, at_a: wp.vec3d, at_b: wp.vec3d,
    parting: wp.vec3d, spin: wp.vec3d, u: wp.vec3d,
):  # fmt: skip
    """The blow that takes back how fast points part and, across u, how fast sides turn apart."""
    K, turn = pushing(a, b, r_a, r_b, at_a, at_b)
    way, spread = turning(a, b, r_a, r_b)
    inverse = wp.inverse(K)
    blow = Blow()
    blow.push = -(inverse * parting)
    held = spread - turn * inverse * way
    blow.torque = crosswise(held, u, -(spin + turn * blow.push))
    blow.push = blow.push - inverse * (way * blow.torque)
    return blow


struck = function(_struck)
