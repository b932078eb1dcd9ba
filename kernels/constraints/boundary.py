"""Boundaries that hold particles off by their radius: one skeleton, a shape plugged into it."""

import functools
from types import SimpleNamespace
from typing import Any

import warp as wp

from ..precision import Precision, function, register, structure
from .boundary_shapes import Shape
from .constraints import bodies_type, place_function, rounding_function
from .easing import ease_function, easing_type
from .rigid_motion import frame_functions, pose_type


def held_type(precision: Precision, shape: Shape) -> Any:
    """The particles that a boundary of a shape holds; one type for all of as many sides."""
    return _held_type(precision, shape.sides)


@functools.cache
def _held_type(precision: Precision, sides: int) -> Any:
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
def bounce_function(precision: Precision) -> wp.Function:
    """``bounce(before, now, e)``: what takes a normal velocity to e times that before, away.

    Mueller et al. (2020), eq. 34. ``before`` is that at the start of the substep, before its
    forces: what rests under gravity does not bounce.
    """
    real = precision.scalar

    def bounce(before: real, now: real, e: real):
        return wp.where(before < real(0.0), wp.max(-e * before - now, real(0.0)), real(0.0))

    return function(bounce)


@functools.cache
def meeting_function(shape: Shape, precision: Precision, params: Any, moving: bool) -> wp.Function:
    """``meet(i, w, x, e, slack, p, h) -> (back, N)``: what particle i at x + e meets in world w.

    The way back to each side, and the sides' normals (see ``boundary_shapes``).
    """
    vec3, sides, each = precision.vec3, shape.sides, shape.each(precision)
    Held = held_type(precision, shape)
    surface, frame = shape.function(precision, params), frame_functions(precision)
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

    return function(meet)


@functools.cache
def relative_functions(
    shape: Shape, precision: Precision, moving: bool
) -> tuple[wp.Function, wp.Function]:
    """Against the surface: ``velocity_of(x, v, w, h)`` and ``slip_of(x, u, dt, w, h)``.

    The velocity v of what is at x, and the way u by which it came there.
    """
    vec3, real, Held = precision.vec3, precision.scalar, held_type(precision, shape)
    frame = frame_functions(precision)
    velocity, way = frame.velocity, frame.way

    def velocity_of(x: vec3, v: vec3, w: int, h: Held):
        if wp.static(moving):
            return v - velocity(x, h.pose[w])
        else:
            return v

    def slip_of(x: vec3, u: vec3, dt: real, w: int, h: Held):
        if wp.static(moving):
            return u - way(x, u, dt, h.pose[w])
        else:
            return u

    return function(velocity_of), function(slip_of)


@functools.cache
def boundary_kernels(
    shape: Shape, precision: Precision, params: Any, compensated: bool, forces: bool, moving: bool
) -> SimpleNamespace:
    """Kernels of a shape: ``begin`` a substep, ``project``, ``bounce``."""
    vec3, real, each = precision.vec3, precision.scalar, shape.each(precision)
    sides, normals = shape.sides, shape.normals(precision)
    Bodies, Held = bodies_type(precision), held_type(precision, shape)
    Easing = easing_type(precision)
    kept, place = rounding_function(precision, compensated), place_function(precision, compensated)
    ease = ease_function(precision)
    friction, rebound = friction_function(precision), bounce_function(precision)
    meet = meeting_function(shape, precision, params, moving)
    velocity_of, slip_of = relative_functions(shape, precision, moving)

    def along_sides(k: int, u: vec3, back: each, N: normals, mu: real, h: Held):
        """What friction takes of the way u on all sides."""
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

    rub = function(along_sides)

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
        if p.friction > real(0.0):
            h.grip[k] = each()

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
            dx = dx - rub(k, slip_of(x, u, dt, w, h), back, N, p.friction, h)
        touched = dx[0] != real(0.0) or dx[1] != real(0.0) or dx[2] != real(0.0)
        if touched and b.w[i] > real(0.0):
            place(i, x, e, dx, b)

    @register
    def bounce_boundary(
        first: int,
        parameters: wp.array(dtype=params),
        h: Held,
        b: Bodies,
        f: wp.array(dtype=vec3),
        dt: real,
        inverse_dt: real,
    ):
        k = first + wp.tid()
        i = h.particle[k]
        w = h.world[k]
        p = parameters[w]
        if p.restitution > real(0.0) and b.w[i] > real(0.0):
            x = b.x[i]
            c = b.correction[i]
            back, N = meet(i, w, x, kept(i, b) - c, h.slack[k], p, h)
            if wp.max(back) > real(0.0):
                v = velocity_of(x, b.v[i], w, h)
                before = v - c * inverse_dt
                if wp.static(forces):
                    before = before - f[i] * (b.w[i] * dt)
                dv = vec3()
                for a in range(wp.static(sides)):
                    if back[a] > real(0.0):
                        n = N[a]
                        now = wp.dot(v + dv, n)
                        dv = dv + n * rebound(wp.dot(before, n), now, p.restitution)
                b.v[i] = b.v[i] + dv

    return SimpleNamespace(begin=begin_boundary, project=project_boundary, bounce=bounce_boundary)
