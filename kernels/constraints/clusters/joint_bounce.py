"""Joints hand on what velocities of their sides were changed by, as bodies that bounce have it."""

import functools
from types import SimpleNamespace

import warp as wp

from ...engine.bounces import bounces_type
from ...precision import function, register
from .blows import Blow, Side, answer, joined, struck, world
from .joints import JointForm, Joints, nearest_function, side_functions
from .members import Form, types, views
from .rotation import spin_of

double = wp.float64


@wp.struct
class Rate:
    """How a side's velocity has changed: at its centre, and its spin."""

    u: wp.vec3d
    spin: wp.vec3d


@functools.cache
def rate_functions(form: Form) -> SimpleNamespace:
    """- ``rate(k, origin, s, box, c, b, v_0)``: how the velocity of cluster k has changed;
    - ``change(k, origin, s, u, phi, box, c, b)``: it changes by u + phi x (r - middle).
    """
    vec3, real = form.precision.vec3, form.precision.scalar
    Clusters, Bodies, Boxes = types(form)
    wide, seen = views(form).wide, views(form).seen
    Vectors = wp.array(dtype=vec3)

    def rate(
        k: int, origin: wp.vec3d, s: Side, box: Boxes, c: Clusters, b: Bodies, v_0: Vectors
    ):  # fmt: skip
        found = Rate()
        for e in range(c.begin[c.chunk[k]], c.begin[c.chunk[k + 1]]):
            i = c.particle[e]
            if b.w[i] > real(0.0):
                u = wide(b.v[i]) - wide(v_0[i])
                found.u += c.weight[e] * u
                r = seen(i, k, origin, box, c, b) - s.middle
                found.spin += c.weight[e] * wp.cross(r, u)
        found.u = found.u / c.total[k]
        found.spin = spin_of(found.spin, s.inertia)
        return found

    def change(
        k: int, origin: wp.vec3d, s: Side, u: wp.vec3d, phi: wp.vec3d, box: Boxes, c: Clusters,
        b: Bodies,
    ):  # fmt: skip
        for e in range(c.begin[c.chunk[k]], c.begin[c.chunk[k + 1]]):
            i = c.particle[e]
            if b.w[i] > real(0.0):
                r = seen(i, k, origin, box, c, b) - s.middle
                b.v[i] = vec3(wide(b.v[i]) + u + wp.cross(phi, r))

    return SimpleNamespace(rate=function(rate), change=function(change))


@functools.cache
def bounce_kernel(form: JointForm) -> wp.Kernel:
    """Kernel: one sweep over the joints of a colour, on velocities.

    What has changed since ``before`` must leave the points together, and the axes of a hinge. Soft
    joints stay as they are, and so do stops.
    """
    Clusters, Bodies, Boxes = types(form.clusters)
    Bounces = bounces_type(form.clusters.precision)
    own, nearest = rate_functions(form.clusters), nearest_function(form.clusters)
    rate, change, hinge = own.rate, own.change, form.hinge
    fit, middle = side_functions(form.clusters).fit, views(form.clusters).middle

    @register
    def bounce_joints(
        first: int, begin: int, box: Boxes, t: Joints, c: Clusters, b: Bodies, bounces: Bounces
    ):
        j = begin + first + wp.tid()
        ka, kb = t.a[j], t.b[j]
        if bounces.running[c.world[ka]] == 0:
            return
        v_0 = bounces.before
        if t.broken[j] != 0 or t.compliance[j] > double(0.0):
            return
        if t.mobile_a[j] + t.mobile_b[j] == double(0.0):
            return
        o_a, o_b = middle(ka, c, b), wp.vec3d()
        sa, sb = fit(ka, t.mobile_a[j], double(0.0), double(0.0), box, c, b), world()
        rate_a, rate_b = rate(ka, o_a, sa, box, c, b, v_0), Rate()
        if kb >= 0:
            o_b = middle(kb, c, b)
            sb = fit(kb, t.mobile_b[j], double(0.0), double(0.0), box, c, b)
            rate_b = rate(kb, o_b, sb, box, c, b, v_0)
        shift = nearest(o_b - o_a, ka, box, c)
        r_a, r_b = sa.R * t.q_a[j], sb.R * t.q_b[j]
        parting = rate_a.u + wp.cross(rate_a.spin, r_a) - rate_b.u - wp.cross(rate_b.spin, r_b)
        way = nearest(sb.middle + r_b + shift - sa.middle - r_a, ka, box, c)
        at = sa.middle + r_a + double(0.5) * way
        blow = Blow()
        if wp.static(hinge):
            u = wp.normalize(sa.R * t.axis[j] + sb.R * t.axis[j])
            spin = rate_a.spin - rate_b.spin
            blow = struck(sa, sb, r_a, r_b, at, at - shift, parting, spin, u)
        else:
            blow.push = joined(sa, sb, r_a, r_b, at, at - shift, -parting, wp.mat33d())
        phi_a = answer(sa, wp.cross(at - sa.start, blow.push) + blow.torque)
        change(ka, o_a, sa, blow.push * sa.light, phi_a, box, c, b)
        if kb >= 0:
            phi_b = answer(sb, -wp.cross(at - shift - sb.start, blow.push) - blow.torque)
            change(kb, o_b, sb, -blow.push * sb.light, phi_b, box, c, b)

    return bounce_joints
