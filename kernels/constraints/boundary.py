"""Boundaries that hold particles off by their radius: one skeleton, a surface plugged into it."""

import functools
from typing import Any, NamedTuple

import warp as wp

from ..engine.easing import ease_function, easing_type
from ..precision import Precision, function, register, structure
from .boundary_shapes import normals_type
from .constraints import bodies_type, place_function, rounding_function
from .rigid_motion import frame_functions, pose_type


class Form(NamedTuple):
    """What the kernels of a boundary are made for.

    Args:
        surface: Where it is (see ``boundary_shapes``).
        sides: At most how many of its sides a particle touches at once.
        precision: Of the simulation.
        params: Struct of what the surface takes, with friction and restitution.
        compensated: Positions come with what rounding has kept from them.
        moving: It has poses.
    """

    surface: wp.Function
    sides: int
    precision: Precision
    params: Any
    compensated: bool
    moving: bool


@functools.cache
def held_type(precision: Precision, sides: int) -> Any:
    """The particles that a boundary holds, with slack and grip by side.

    Grip is how far friction may still take particles back in this substep: mu times the normal
    corrections less what it has taken. It outlives an iteration, so that a side that one iteration
    pressed on holds against what the next one does along it.
    """
    each = precision.vector(sides)
    fields = {
        "particle": wp.array(dtype=wp.int32),
        "world": wp.array(dtype=wp.int32),
        "radius": wp.array(dtype=precision.scalar),  # by particle
        "slack": wp.array(dtype=each),
        "marked": wp.array(dtype=wp.int32),  # worlds whose slack is to be measured
        "grip": wp.array(dtype=each),  # empty where nothing rubs
        "rebound": wp.array(dtype=each),  # speeds to bounce off at, 0: not; empty like grip
        "impulse": wp.array(dtype=each),  # that have sent them off so far, over their masses
        "pressed": wp.array(dtype=precision.vec3),  # how far it has moved them in a substep
        "pose": wp.array(dtype=pose_type(precision)),  # by world; empty where nothing moves
    }
    return structure(f"Held{sides}_{precision.name}", fields)


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
def meeting_function(form: Form) -> wp.Function:
    """``meet(i, w, x, e, slack, p, h) -> (back, N)``: what particle i at x + e meets in world w.

    The way back to each side, and the sides' normals (see ``boundary_shapes``).
    """
    surface, sides, precision, params, _, moving = form
    vec3, each, Held = precision.vec3, precision.vector(sides), held_type(precision, sides)
    frame = frame_functions(precision)
    inward, outward = frame.inward, frame.outward

    def meet(i: int, w: int, x: vec3, e: vec3, slack: each, p: params, h: Held):
        y = x
        rest = e
        if wp.static(moving):
            y, rest = inward(y, rest, h.pose[w])
        back, N = surface(y, rest, h.radius[i], slack, p)
        if wp.static(moving):
            for a in range(wp.static(sides)):
                N[a] = outward(N[a], h.pose[w])
        return back, N

    # Emitted behind the surface, which may itself stand behind the gradient that it takes.
    return function(meet, after_gradients=True)


@functools.cache
def velocity_function(form: Form) -> wp.Function:
    """``velocity_of(x, v, w, h)``: the velocity v of what is at x, against the surface."""
    precision, moving = form.precision, form.moving
    vec3, Held = precision.vec3, held_type(precision, form.sides)
    velocity = frame_functions(precision).velocity

    def velocity_of(x: vec3, v: vec3, w: int, h: Held):
        if wp.static(moving):
            return v - velocity(x, h.pose[w])
        else:
            return v

    return function(velocity_of)


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
    meet, velocity_of, ease = (
        meeting_function(form),
        velocity_function(form),
        ease_function(precision),
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
        if h.marked[w] != 0:
            # Where the substep began: the way since is no overlap. The subtraction rounds as much
            # as a compensated sum has kept.
            start = b.x[i] - dt * velocity_of(b.x[i], b.v[i], w, h)
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
def project_kernel(form: Form) -> wp.Kernel:
    """Kernel: particles are brought back to where they may be, and held along it."""
    _, sides, precision, params, compensated, _ = form
    vec3, real = precision.vec3, precision.scalar
    Bodies, Held = bodies_type(precision), held_type(precision, sides)
    kept, place = rounding_function(precision, compensated), place_function(precision, compensated)
    meet, rub = meeting_function(form), rubbing_function(form)

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
            dx = dx - rub(k, x, u, dt, w, back, N, p.friction, h)
        touched = dx[0] != real(0.0) or dx[1] != real(0.0) or dx[2] != real(0.0)
        if touched and b.w[i] > real(0.0):
            place(i, x, e, dx, b)
            h.pressed[k] = h.pressed[k] + dx

    return project_boundary
