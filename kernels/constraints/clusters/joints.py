"""Joints: two clusters, or a cluster and the world, hold together at a point, and along an axis.

Both sides answer as rigid bodies: an impulse at a point of one moves all of its members.
"""

import functools
from dataclasses import dataclass
from types import SimpleNamespace

import warp as wp

from ...precision import function, register
from ..constraints import place_function
from .blows import Blow, Side, answer, hinged, joined, world
from .cluster_motion import inertia
from .members import Form, types, views
from .rotation import best_turn

double = wp.float64


@wp.struct
class Joints:
    """Joints between clusters, sorted by colour."""

    a: wp.array(dtype=wp.int32)
    b: wp.array(dtype=wp.int32)  # -1: the world
    q_a: wp.array(dtype=wp.vec3d)  # the point, from the centre of the rest shape of a
    q_b: wp.array(dtype=wp.vec3d)  # and of b; of the world, from the origin
    mobile_a: wp.array(dtype=wp.float64)  # 1, or 0 where all members are pinned
    mobile_b: wp.array(dtype=wp.float64)
    axis: wp.array(dtype=wp.vec3d)  # of a hinge, in the rest shapes
    arm: wp.array(dtype=wp.vec3d)  # across it
    lower: wp.array(dtype=wp.float64)  # angle of b against a, right-handed about the axis
    upper: wp.array(dtype=wp.float64)
    compliance: wp.array(dtype=wp.float64)
    limit: wp.array(dtype=wp.float64)  # break_force
    broken: wp.array(dtype=wp.int32)
    lam: wp.array(dtype=wp.vec3d)


@dataclass(frozen=True)
class JointForm:
    """What kernels of joints are made for."""

    clusters: Form
    hinge: bool


@functools.cache
def side_functions(form: Form) -> SimpleNamespace:
    """- ``fit(k, light, dt, timed, box, c, b)``: cluster k as a Side;
    - ``move(k, u, phi, start, dt, timed, box, c, b)``: its members go by u + phi x (p - start), p
      where they were, so that momentum and angular momentum are those of the impulse.
    """
    real, vec3 = form.precision.scalar, form.precision.vec3
    Clusters, Bodies, Boxes = types(form)
    own, place = views(form), place_function(form.precision, form.compensated)
    wide, seen, kept, middle = own.wide, own.seen, own.kept, own.middle

    def way(i: int, dt: wp.float64, timed: wp.float64, b: Bodies):
        return timed * (wide(b.v[i]) * dt + wide(b.correction[i]))

    way = function(way)

    def fit(
        k: int, mobile: wp.float64, dt: wp.float64, timed: wp.float64, box: Boxes, c: Clusters,
        b: Bodies,
    ):  # fmt: skip
        origin = middle(k, c, b)
        s = Side()
        A, P = wp.mat33d(), wp.mat33d()
        for e in range(c.begin[c.chunk[k]], c.begin[c.chunk[k + 1]]):
            i = c.particle[e]
            m = c.weight[e]
            r = seen(i, k, origin, box, c, b)
            p = r - way(i, dt, timed, b)
            s.middle += m * r
            s.start += m * p
            s.inertia += m * inertia(p)
            A += m * wp.outer(r, c.rest[e])
            P += m * wp.outer(p, c.rest[e])
        s.middle = s.middle / c.total[k]
        s.start = s.start / c.total[k]
        s.inertia = s.inertia - c.total[k] * inertia(s.start)
        turn = best_turn(A)
        c.turn[k] = turn
        s.R = wp.quat_to_matrix(turn)
        s.R_0 = wp.quat_to_matrix(best_turn(P))
        s.light = mobile / c.total[k]
        return s

    def move(
        k: int, origin: wp.vec3d, u: wp.vec3d, phi: wp.vec3d, start: wp.vec3d, dt: wp.float64,
        timed: wp.float64, box: Boxes, c: Clusters, b: Bodies,
    ):  # fmt: skip
        for e in range(c.begin[c.chunk[k]], c.begin[c.chunk[k + 1]]):
            i = c.particle[e]
            if b.w[i] > real(0.0):
                p = seen(i, k, origin, box, c, b) - way(i, dt, timed, b)
                dx = vec3(u + wp.cross(phi, p - start))
                place(i, b.x[i], kept(i, b), dx, b)

    return SimpleNamespace(fit=function(fit), move=function(move), middle=middle)


def nearest_function(form: Form) -> wp.Function:
    """``nearest(d, k, box, c)``: a distance in the world of cluster k to the nearest image."""
    Clusters, _, Boxes = types(form)
    wraps = bool(form.periodic)

    def nearest(d: wp.vec3d, k: int, box: Boxes, c: Clusters):
        r = d
        if wp.static(wraps):
            B = box[c.world[k]]
            for n in range(3):
                r[n] = d[n] - double(B.length[n]) * wp.rint(d[n] * double(B.inverse[n]))
        return r

    return function(nearest)


@functools.cache
def project_kernel(form: JointForm) -> wp.Kernel:
    """Kernel: one sweep over the joints of a colour.

    The impulse d_lam solves (K + alpha~) d_lam = -d - alpha~ lam, d from the point of b to that of
    a, all directions at once. It acts on both at one place, between the points as they were: no
    angular momentum comes of it.
    """
    Clusters, Bodies, Boxes = types(form.clusters)
    own, nearest = side_functions(form.clusters), nearest_function(form.clusters)
    fit, move, middle, hinge = own.fit, own.move, own.middle, form.hinge

    @register
    def project_joints(
        first: int, begin: int, fresh: int, dt: wp.float64, inverse_dt: wp.float64,
        timed: wp.float64, box: Boxes, t: Joints, c: Clusters, b: Bodies,
    ):  # fmt: skip
        j = begin + first + wp.tid()
        ka, kb = t.a[j], t.b[j]
        if fresh != 0:
            t.lam[j] = wp.vec3d()
        if t.broken[j] != 0 or t.mobile_a[j] + t.mobile_b[j] == double(0.0):
            return
        o_a = middle(ka, c, b)
        sa = fit(ka, t.mobile_a[j], dt, timed, box, c, b)
        o_b = wp.vec3d()
        sb = Side()
        if kb >= 0:
            o_b = middle(kb, c, b)
            sb = fit(kb, t.mobile_b[j], dt, timed, box, c, b)
        else:
            sb = world()
        shift = nearest(o_b - o_a, ka, box, c)
        r_a, r_b = sa.R * t.q_a[j], sb.R * t.q_b[j]
        away = nearest(sa.middle + r_a - sb.middle - r_b - shift, ka, box, c)
        was_a, was_b = sa.start + sa.R_0 * t.q_a[j], sb.start + sb.R_0 * t.q_b[j]
        at = was_a + double(0.5) * nearest(was_b + shift - was_a, ka, box, c)
        alpha = t.compliance[j] * inverse_dt * inverse_dt
        off, soft = -(away + alpha * t.lam[j]), alpha * wp.identity(n=3, dtype=double)
        blow = Blow()
        if wp.static(hinge):
            stop, u, v = wp.vec2d(t.lower[j], t.upper[j]), t.axis[j], t.arm[j]
            blow = hinged(sa, sb, r_a, r_b, at, at - shift, off, soft, u, v, stop)
        else:
            blow.push = joined(sa, sb, r_a, r_b, at, at - shift, off, soft)
        t.lam[j] = t.lam[j] + blow.push
        phi_a = answer(sa, wp.cross(at - sa.start, blow.push) + blow.torque)
        phi_b = answer(sb, -wp.cross(at - shift - sb.start, blow.push) - blow.torque)
        move(ka, o_a, blow.push * sa.light, phi_a, sa.start, dt, timed, box, c, b)
        if kb >= 0:
            move(kb, o_b, -blow.push * sb.light, phi_b, sb.start, dt, timed, box, c, b)

    return project_joints


@functools.cache
def strain_kernel() -> wp.Kernel:
    """Kernel: the force of each joint, |lam| / dt^2; those of more than allowed break."""

    @register
    def strain_joints(
        first: int, may_break: int, t: Joints, scale: wp.float64,
        force_out: wp.array(dtype=wp.float64),
    ):  # fmt: skip
        j = first + wp.tid()
        force = wp.length(t.lam[j]) * scale
        force_out[j] = force
        if may_break != 0 and force > t.limit[j]:
            t.broken[j] = 1

    return strain_joints
