"""What tuples do to velocities that have followed the projection: damp, and pass bounces on.

Impulses J go along the gradients where the particles are, v_a += w_a grad_a C J, which keeps
angular momentum, and add to the multipliers: J dt is what a projection would have made of them.
"""

import functools

import warp as wp

from ...engine.bounces import bounces_type
from ...precision import function, register
from ..constraints import Solved, positions_type, view_function


def _look_function(law: Solved) -> wp.Function:
    """``look(r, box, t, b) -> (holds, G, rate, s)``: whether tuple r may give an impulse, its
    gradient, grad C . v, and sum w |grad C|^2. An inequality holds if the projection has pushed.
    """
    real, Box, Tuples, Bodies = law.types
    size, view = law.size, view_function(law)
    one_sided, breakable = law.one_sided, law.breakable

    def look(r: int, box: wp.array(dtype=Box), t: Tuples, b: Bodies):
        ids = t.particle[r]
        _X, _C, G = view(r, box, t, b)
        rate = real(0.0)
        s = real(0.0)
        for a in range(wp.static(size)):
            rate += wp.dot(G[a], b.v[ids[a]])
            s += b.w[ids[a]] * b.unit * wp.length_sq(G[a])
        holds = s > real(0.0)
        if wp.static(breakable):
            holds = holds and t.broken[r] == 0
        if wp.static(one_sided):
            holds = holds and t.lam[r] > real(0.0)
        return holds, G, rate, s

    return function(look, after_gradients=True)


def _give_function(law: Solved) -> wp.Function:
    """``give(r, G, push, t, b, dt) -> J``: the impulse of tuple r, by an inequality no pull."""
    real, _, Tuples, Bodies = law.types
    size, one_sided, positions = law.size, law.one_sided, positions_type(law.precision, law.size)

    def give(r: int, G: positions, push: real, t: Tuples, b: Bodies, dt: real):
        if wp.static(one_sided):
            push = wp.max(push, -t.lam[r] / dt)
        if not wp.isfinite(push):
            push = real(0.0)
        t.lam[r] = t.lam[r] + push * dt
        ids = t.particle[r]
        for a in range(wp.static(size)):
            b.v[ids[a]] = b.v[ids[a]] + G[a] * (b.w[ids[a]] * b.unit * push)
        return push

    return function(give)


@functools.cache
def damp_kernel(law: Solved) -> wp.Kernel:
    """Kernel: f = -beta dC/dt grad C on the tuples of a colour, implicit in the velocity.

    J = -beta dt grad C . v / (1 + beta dt sum w |grad C|^2): what rests is left alone.
    """
    real, Box, Tuples, Bodies = law.types
    look, give = _look_function(law), _give_function(law)

    @register
    def damp_tuples(
        first: int, start: int, box: wp.array(dtype=Box), t: Tuples, b: Bodies, dt: real
    ):
        r = start + first + wp.tid()
        q = t.item[r]
        if q.damping * q.compliance == real(0.0):  # of a rigid one there is nothing to damp
            return
        holds, G, rate, s = look(r, box, t, b)
        if holds:
            beta = q.damping * (dt / b.unit)
            give(r, G, -beta * rate / (real(1.0) + beta * s), t, b, dt)

    return damp_tuples


@functools.cache
def bounce_kernel(law: Solved) -> wp.Kernel:
    """Kernel: what tuples of a colour hand on of an impulse.

    J grows by (-grad C . (v - rho u) - alpha~ J) / (s + alpha~), s = sum w |grad C|^2, as the
    multiplier of the projection does. u is the velocity before, and rho = alpha~ / (s + alpha~):
    what is rigid keeps C as it is, and an impulse goes through it at once; what gives way goes on
    as it did, but for what a substep hands on.
    """
    real, Box, Tuples, Bodies = law.types
    look, give = _look_function(law), _give_function(law)
    size, Bounces = law.size, bounces_type(law.precision)

    @register
    def bounce_tuples(
        first: int, start: int, box: wp.array(dtype=Box), t: Tuples, b: Bodies, dt: real,
        push_io: wp.array(dtype=real), bounces: Bounces, inverse_dt: real,
    ):  # fmt: skip
        r = start + first + wp.tid()
        if bounces.running[t.world[r]] == 0:
            return
        holds, G, rate, s = look(r, box, t, b)
        if holds:
            before = real(0.0)
            for a in range(wp.static(size)):
                before += wp.dot(G[a], bounces.before[t.particle[r][a]])
            alpha = t.item[r].compliance * inverse_dt * b.unit * inverse_dt
            push = -(rate - before * alpha / (s + alpha) + alpha * push_io[r]) / (s + alpha)
            push_io[r] = push_io[r] + give(r, G, push, t, b, dt)

    return bounce_tuples


@functools.cache
def straighten_kernel(law: Solved) -> wp.Kernel:
    """Kernel: velocities that leave the rigid tuples of a colour as they are, grad C . v = 0.

    The second half of RATTLE (Andersen 1983): J = -grad C . v / sum w |grad C|^2.
    """
    real, Box, Tuples, Bodies = law.types
    look, give = _look_function(law), _give_function(law)

    @register
    def straighten_tuples(
        first: int, start: int, box: wp.array(dtype=Box), t: Tuples, b: Bodies, dt: real
    ):
        r = start + first + wp.tid()
        if t.item[r].compliance > real(0.0):
            return
        holds, G, rate, s = look(r, box, t, b)
        if holds:
            give(r, G, -rate / s, t, b, dt)

    return straighten_tuples
