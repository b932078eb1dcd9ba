"""What bounces off a boundary: at which speed, and the impulses that send it off."""

import functools

import warp as wp

from ...engine.bounces import ENOUGH, bounces_type
from ...precision import register
from ..boundary import friction_function
from ..constraints import bodies_type, rounding_function
from .meeting import (
    Form,
    held_type,
    meeting_function,
    touching_function,
    velocity_function,
)

RESTING = (
    1.0e-3  # of the speed that the projection has taken: what comes slower is pressed, not hit
)


@functools.cache
def start_bounce_kernel(form: Form, forces: bool) -> wp.Kernel:
    """Kernel: who has met a side leaves it at e times the speed at which it came.

    Mueller et al. (2020), eq. 34. That speed is the one at the start of the substep, before its
    forces: what rests under gravity does not bounce. What the projection has made of its velocity
    goes by how deep it came, that is by the phase of the impact in the substep: it is given back,
    and the whole impulse is that of the sweeps.
    """
    sides, precision, params = form.sides, form.precision, form.params
    vec3, real, each = precision.vec3, precision.scalar, precision.vector(sides)
    Bodies, Held = bodies_type(precision), held_type(precision, sides)
    Bounces = bounces_type(precision)
    kept = rounding_function(precision, form.compensated)
    meet, velocity_of = meeting_function(form), velocity_function(form)
    touching = touching_function(form)

    @register
    def start_boundary_bounce(
        first: int, parameters: wp.array(dtype=params), h: Held, b: Bodies,
        f: wp.array(dtype=vec3), bounces: Bounces, dt: real, inverse_dt: real,
    ):  # fmt: skip
        k = first + wp.tid()
        i = h.particle[k]
        w = h.world[k]
        p = parameters[w]
        hit = each()
        if p.by_impulse > real(0.0) and b.w[i] > real(0.0):
            x = b.x[i]
            c = b.correction[i]
            back, N = meet(i, w, x, kept(i, b) - c, h.slack[k], p, h)
            if wp.max(back) > real(0.0):
                v = velocity_of(x, b.v[i], w, h)
                before = v - c * inverse_dt
                v = v - h.pressed[k] * inverse_dt
                _mu, restitution = touching(i, w, x, kept(i, b) - c, p, h)
                if wp.static(forces):
                    before = before - f[i] * (b.w[i] * dt)
                for a in range(wp.static(sides)):
                    came = -wp.dot(before, N[a])
                    pressed = wp.dot(c, N[a]) * inverse_dt
                    if back[a] > real(0.0) and came > wp.max(real(RESTING) * pressed, real(0.0)):
                        hit[a] = came
                        missing = restitution * came - wp.dot(v, N[a])
                        if missing > real(ENOUGH) * came:
                            bounces.again[w] = 1
                if wp.max(hit) > real(0.0):
                    b.v[i] = b.v[i] - h.pressed[k] * inverse_dt
                    h.pressed[k] = vec3()
                    if p.friction > real(0.0):
                        h.grip[k] = each()
        h.came[k] = hit
        h.impulse[k] = each()

    return start_boundary_bounce


@functools.cache
def bounce_kernel(form: Form) -> wp.Kernel:
    """Kernel: impulses away from sides, up to the speeds to bounce off at, and friction by them.

    An impulse is taken back where others have sent a particle off even faster, but never pulls.
    Friction takes of the way along a side what mu times all normal impulses of the substep allow.
    """
    sides, precision, params = form.sides, form.precision, form.params
    vec3, real = precision.vec3, precision.scalar
    Bodies, Held = bodies_type(precision), held_type(precision, sides)
    Bounces = bounces_type(precision)
    kept, friction = rounding_function(precision, form.compensated), friction_function(precision)
    meet, velocity_of = meeting_function(form), velocity_function(form)
    touching = touching_function(form)

    @register
    def bounce_boundary(
        first: int, parameters: wp.array(dtype=params), h: Held, b: Bodies, bounces: Bounces,
        dt: real, inverse_dt: real,
    ):  # fmt: skip
        k = first + wp.tid()
        w = h.world[k]
        came = h.came[k]
        if bounces.running[w] == 0 or not wp.max(came) > real(0.0):
            return
        i = h.particle[k]
        p = parameters[w]
        x = b.x[i]
        _back, N = meet(i, w, x, kept(i, b) - b.correction[i], h.slack[k], p, h)
        v = velocity_of(x, b.v[i], w, h)
        mu, restitution = touching(i, w, x, kept(i, b) - b.correction[i], p, h)
        sent = h.impulse[k]
        dv = vec3()
        for a in range(wp.static(sides)):
            if came[a] > real(0.0):
                n = N[a]
                push = wp.max(restitution * came[a] - wp.dot(v + dv, n), -sent[a])
                if wp.abs(push) > real(ENOUGH) * came[a]:
                    bounces.again[w] = 1
                sent[a] = sent[a] + push
                dv = dv + n * push
                if p.friction > real(0.0):
                    grip = h.grip[k]
                    grip[a] = grip[a] + mu * push * dt
                    if grip[a] > real(0.0):
                        taken = friction((v + dv) * dt, n, grip[a])
                        grip[a] = grip[a] - wp.length(taken)
                        dv = dv - taken * inverse_dt
                    h.grip[k] = grip
        h.impulse[k] = sent
        h.pressed[k] = h.pressed[k] + dv * dt
        b.v[i] = b.v[i] + dv

    return bounce_boundary
