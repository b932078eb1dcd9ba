"""What tuples do to velocities that have followed the projection: damp, and pass bounces on."""

import functools

import warp as wp

from ..engine.bounces import bounces_type
from ..precision import register
from .constraints import Solved, view_function


@functools.cache
def damp_kernel(law: Solved) -> wp.Kernel:
    """Kernel: f = -beta dC/dt grad C on the tuples of a colour, implicit in the velocity.

    J = -beta dt grad C . v / (1 + beta dt sum w |grad C|^2), v_a += w_a grad_a C J, with the
    gradient where the particles are: angular momentum is kept, and what rests is left alone. J adds
    to the multiplier, so that an inequality does not pull in all.
    """
    real, Box, Tuples, Bodies = law.types
    size, view = law.size, view_function(law)
    one_sided, breakable = law.one_sided, law.breakable

    @register
    def damp_tuples(
        first: int, start: int, box: wp.array(dtype=Box), t: Tuples, b: Bodies, dt: real,
        inverse_dt: real,
    ):  # fmt: skip
        r = start + first + wp.tid()
        q = t.item[r]
        if q.damping * q.compliance == real(0.0):  # of a rigid one there is nothing to damp
            return
        if wp.static(breakable):
            if t.broken[r] != 0:
                return
        ids = t.particle[r]
        _X, _C, G = view(r, box, t, b)
        rate = real(0.0)
        s = real(0.0)
        for a in range(wp.static(size)):
            rate += wp.dot(G[a], b.v[ids[a]])
            s += b.w[ids[a]] * b.unit * wp.length_sq(G[a])
        beta = q.damping * (dt / b.unit)
        impulse = -beta * rate / (real(1.0) + beta * s)
        if wp.static(one_sided):
            impulse = wp.max(impulse, -t.lam[r] * inverse_dt)
            impulse = wp.where(t.lam[r] > real(0.0), impulse, real(0.0))
        if wp.isfinite(impulse * s):
            t.lam[r] = t.lam[r] + impulse * dt
            for a in range(wp.static(size)):
                b.v[ids[a]] = b.v[ids[a]] + G[a] * (b.w[ids[a]] * b.unit * impulse)

    return damp_tuples


@functools.cache
def bounce_kernel(law: Solved) -> wp.Kernel:
    """Kernel: what tuples of a colour hand on of an impulse.

    J grows by (-grad C . (v - rho u) - alpha~ J) / (s + alpha~), s = sum w |grad C|^2, as the
    multiplier of the projection does. u is the velocity before, and rho = alpha~ / (s + alpha~):
    what is rigid keeps C as it is, and an impulse goes through it at once; what gives way goes on
    as it did, but for what a substep hands on. Inequalities hand on what they hold, and only push.
    """
    real, Box, Tuples, Bodies = law.types
    size, view, Bounces = law.size, view_function(law), bounces_type(law.precision)
    one_sided, breakable = law.one_sided, law.breakable

    @register
    def bounce_tuples(
        first: int, start: int, box: wp.array(dtype=Box), t: Tuples, b: Bodies,
        push_io: wp.array(dtype=real), bounces: Bounces, dt: real, inverse_dt: real,
    ):  # fmt: skip
        r = start + first + wp.tid()
        if bounces.running[t.world[r]] == 0:
            return
        if wp.static(breakable):
            if t.broken[r] != 0:
                return
        if wp.static(one_sided):
            if t.lam[r] == real(0.0):
                return
        ids = t.particle[r]
        _X, _C, G = view(r, box, t, b)
        rate = real(0.0)
        before = real(0.0)
        s = real(0.0)
        for a in range(wp.static(size)):
            i = ids[a]
            rate += wp.dot(G[a], b.v[i])
            before += wp.dot(G[a], bounces.before[i])
            s += b.w[i] * b.unit * wp.length_sq(G[a])
        alpha = t.item[r].compliance * inverse_dt * b.unit * inverse_dt
        push = -(rate - before * alpha / (s + alpha) + alpha * push_io[r]) / (s + alpha)
        if wp.static(one_sided):
            push = wp.max(push, -t.lam[r] * inverse_dt)
        if wp.isfinite(push * s):
            push_io[r] = push_io[r] + push
            t.lam[r] = t.lam[r] + push * dt
            for a in range(wp.static(size)):
                b.v[ids[a]] = b.v[ids[a]] + G[a] * (b.w[ids[a]] * b.unit * push)

    return bounce_tuples
