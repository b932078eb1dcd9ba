"""Boundaries that hold particles off by their radius: one skeleton, a surface plugged into it."""

import functools

import warp as wp

from ..engine.easing import ease_function, easing_type
from ..precision import Precision, function, register
from .boundaries.meeting import (
    Form,
    held_type,
    meeting_function,
    seen_function,
    touching_function,
    velocity_function,
)
from .boundary_shapes import normals_type
from .constraints import bodies_type, place_function, rounding_function
from .rigid_motion import frame_functions


@functools.cache
def friction_function(precision: Precision) -> wp.Function:
    """``rub(u, n, grip)``: what friction takes back of the way u along a side of normal n.

    All of the tangential way, or as much as there is grip for (Macklin et al. 2014, eq. 24, with
    one coefficient). Grip is above 0.
    """
    vec3, real = precision.vec3, precision.scalar

    def rub(u: vec3, n: vec3, grip: real):
        t = u - n * wp.dot(u, n)
        length = wp.length(t)
        factor = real(1.0)
        if length > grip:
            factor = grip / length
        return t * factor

    return function(rub)


@functools.cache
def rubbing_function(form: Form) -> wp.Function:
    """``rub(k, x, u, dt, w, back, N, mu, h)``: what friction takes back of the way u to x."""
    precision, sides, moving = form.precision, form.sides, form.moving
    vec3, real, each = precision.vec3, precision.scalar, precision.vector(sides)
    normals, Held = normals_type(precision, sides), held_type(precision, sides)
    friction, way = friction_function(precision), frame_functions(precision).way

    def along_sides(
        k: int, x: vec3, u: vec3, dt: real, w: int, back: each, N: normals, mu: real, h: Held
    ):
        if wp.static(moving):
            u = u - way(x, u, dt, h.pose[w])
        grip = h.grip[k] + back * mu
        if wp.static(sides > 1):
            for a in range(wp.static(sides)):
                if back[a] > real(0.0):  # a way into one side is no slip along another
                    u = u - N[a] * wp.dot(u, N[a])
        total = vec3()
        for a in range(wp.static(sides)):
            if grip[a] > real(0.0):
                taken = friction(u, N[a], grip[a])
                grip[a] = grip[a] - wp.length(taken)
                total = total + taken
                u = u - taken
        h.grip[k] = grip
        return total

    return function(along_sides)


@functools.cache
def begin_kernel(form: Form) -> wp.Kernel:
    """Kernel: as a substep starts, slack is measured where it is to be, and runs out."""
    sides, precision, params = form.sides, form.precision, form.params
    vec3, real, each = precision.vec3, precision.scalar, precision.vector(sides)
    Bodies, Held, Easing = (
        bodies_type(precision),
        held_type(precision, sides),
        easing_type(precision),
    )
    meet, velocity_of, ease, seen = (
        meeting_function(form),
        velocity_function(form),
        ease_function(precision),
        seen_function(form),
    )

    @register
    def begin_boundary(
        first: int, parameters: wp.array(dtype=params), h: Held, b: Bodies, easing: Easing, dt: real
    ):
        k = first + wp.tid()
        i = h.particle[k]
        w = h.world[k]
        p = parameters[w]
        slack = h.slack[k]
        # Where the substep began: the way since is no overlap. The subtraction rounds as much as a
        # compensated sum has kept.
        start = b.x[i] - dt * velocity_of(b.x[i], b.v[i], w, h)
        if wp.static(form.tracked):
            h.start[i] = seen(start, w, h)
        if h.marked[w] != 0:
            slack, _N = meet(i, w, start, vec3(), each(), p, h)
        for a in range(wp.static(sides)):
            if slack[a] > real(0.0):
                slack[a] = ease(slack[a], h.radius[i], dt, easing)
        h.slack[k] = slack
        h.pressed[k] = vec3()
        if p.friction > real(0.0):
            h.grip[k] = each()

    return begin_boundary


@functools.cache
def track_kernel(form: Form) -> wp.Kernel:
    """Kernel: outside of time particles have come from where they are."""
    params, Bodies = form.params, bodies_type(form.precision)
    Held, seen = held_type(form.precision, form.sides), seen_function(form)

    @register
    def track_start(first: int, parameters: wp.array(dtype=params), h: Held, b: Bodies):
        k = first + wp.tid()
        i = h.particle[k]
        h.start[i] = seen(b.x[i], h.world[k], h)

    return track_start


@functools.cache
def project_kernel(form: Form) -> wp.Kernel:
    """Kernel: particles are brought back to where they may be, and held along it."""
    sides, precision, params, compensated = form[1:5]
    vec3, real = precision.vec3, precision.scalar
    Bodies, Held = bodies_type(precision), held_type(precision, sides)
    kept, place = rounding_function(precision, compensated), place_function(precision, compensated)
    meet, rub, touching = meeting_function(form), rubbing_function(form), touching_function(form)

    @register
    def project_boundary(
        first: int, parameters: wp.array(dtype=params), h: Held, b: Bodies, timed: real, dt: real
    ):
        """``timed`` 0: a projection outside of time, which knows neither slack nor friction."""
        k = first + wp.tid()
        i = h.particle[k]
        w = h.world[k]
        p = parameters[w]
        x = b.x[i]
        e = kept(i, b)
        back, N = meet(i, w, x, e, h.slack[k] * timed, p, h)
        dx = vec3()
        if wp.max(back) > real(0.0):  # few do
            for a in range(wp.static(sides)):
                dx = dx + N[a] * back[a]
        if timed * p.friction > real(0.0):
            u = b.v[i] * dt + b.correction[i]
            mu, _rest = touching(i, w, x, e, p, h)
            dx = dx - rub(k, x, u, dt, w, back, N, mu, h)
        touched = dx[0] != real(0.0) or dx[1] != real(0.0) or dx[2] != real(0.0)
        if touched and b.w[i] > real(0.0):
            place(i, x, e, dx, b)
            h.pressed[k] = h.pressed[k] + dx

    return project_boundary
