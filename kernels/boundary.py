"""Boundaries: planes and boxes that particles stay inside of, by their radius."""

import functools
from typing import Any

import warp as wp

from .constraints import bodies_type, place_function
from .easing import ease_function, easing_type
from .precision import Precision, function, register, structure


@functools.cache
def held_type(precision: Precision, each: Any) -> Any:
    """The particles that a boundary holds, with one ``each`` of slack and of grip.

    Grip is how far friction may still take particles back in this substep: mu times the normal
    corrections less what it has taken. It outlives an iteration, so that a side that one iteration
    pressed on holds against what the next one does along it.
    """
    fields = {
        "particle": wp.array(dtype=wp.int32),
        "world": wp.array(dtype=wp.int32),
        "radius": wp.array(dtype=precision.scalar),  # by particle
        "slack": wp.array(dtype=each),
        "marked": wp.array(dtype=wp.int32),  # worlds whose slack is to be measured
        "grip": wp.array(dtype=each),  # empty where nothing rubs
    }
    return structure(f"Held_{precision.name}_{each.__name__}", fields)


@functools.cache
def friction_function(precision: Precision) -> wp.Function:
    """``rub(u, n, grip)``: what friction takes back of the way u along a side of normal n.

    All of the tangential way, or as much as there is grip for (Macklin et al. 2014, eq. 24, with
    one coefficient).
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
def plane_kernels(
    precision: Precision, params: Any, compensated: bool, forces: bool
) -> tuple[wp.Kernel, wp.Kernel, wp.Kernel]:
    """Kernels of a half space (x - point) . n >= R: start of a substep, projection, bounce."""
    vec3, real = precision.vec3, precision.scalar
    Bodies, Easing, Held = (
        bodies_type(precision),
        easing_type(precision),
        held_type(precision, real),
    )
    place, ease = place_function(precision, compensated), ease_function(precision)
    friction, rebound = friction_function(precision), bounce_function(precision)

    def height(i: int, p: params, b: Bodies):
        d = b.x[i] - p.point
        if wp.static(compensated):
            d = d + b.x_error[i]
        return wp.dot(d, p.normal)

    above = function(height)

    @register
    def begin_plane(
        first: int, parameters: wp.array(dtype=params), h: Held, b: Bodies, easing: Easing, dt: real
    ):
        k = first + wp.tid()
        i = h.particle[k]
        p = parameters[h.world[k]]
        R = h.radius[i]
        s = h.slack[k]
        if h.marked[h.world[k]] != 0:
            # Where the substep began: the way since is no overlap.
            s = wp.max(R - (above(i, p, b) - dt * wp.dot(b.v[i], p.normal)), real(0.0))
        if s > real(0.0):
            s = ease(s, R, dt, easing)
        h.slack[k] = s
        if p.friction > real(0.0):
            h.grip[k] = real(0.0)

    @register
    def project_plane(
        first: int, parameters: wp.array(dtype=params), h: Held, b: Bodies, moving: real, dt: real
    ):
        k = first + wp.tid()
        i = h.particle[k]
        p = parameters[h.world[k]]
        d = wp.max(h.radius[i] - moving * h.slack[k] - above(i, p, b), real(0.0))
        dx = p.normal * d
        rubs = moving * p.friction > real(0.0)
        if rubs:
            grip = h.grip[k] + p.friction * d
            rubs = grip > real(0.0)
            taken = friction(b.v[i] * dt + b.correction[i], p.normal, grip)
            h.grip[k] = grip - wp.length(taken)
            dx = dx - taken
        if (d > real(0.0) or rubs) and b.w[i] > real(0.0):
            e = vec3()
            if wp.static(compensated):
                e = b.x_error[i]
            place(i, b.x[i], e, dx, b)

    @register
    def bounce_plane(
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
        p = parameters[h.world[k]]
        c = b.correction[i]
        d = h.radius[i] - h.slack[k] - (above(i, p, b) - wp.dot(c, p.normal))
        if p.restitution > real(0.0) and d > real(0.0) and b.w[i] > real(0.0):
            v = b.v[i]
            before = v - c * inverse_dt
            if wp.static(forces):
                before = before - f[i] * (b.w[i] * dt)
            dv = rebound(wp.dot(before, p.normal), wp.dot(v, p.normal), p.restitution)
            b.v[i] = v + p.normal * dv

    return begin_plane, project_plane, bounce_plane


@functools.cache
def box_kernels(
    precision: Precision, params: Any, compensated: bool, forces: bool
) -> tuple[wp.Kernel, wp.Kernel, wp.Kernel]:
    """Kernels of the inside of a box, lower + R <= x <= upper - R: as for a plane.

    Slack and grip are by axis. Where the box is too narrow for a particle, the middle is right.
    """
    vec3, real = precision.vec3, precision.scalar
    Bodies, Easing, Held = (
        bodies_type(precision),
        easing_type(precision),
        held_type(precision, vec3),
    )
    place, ease = place_function(precision, compensated), ease_function(precision)
    friction, rebound = friction_function(precision), bounce_function(precision)

    def outside(x: real, e: real, lower: real, upper: real, radius: real, slack: real):
        """Way back between the sides that are closed; infinite ones are open."""
        first = lower + radius
        last = upper - radius
        if first > last:
            first = real(0.5) * (lower + upper)
            last = first
        low = (first - slack - x) - e
        high = (last + slack - x) - e
        return wp.max(low, real(0.0)) + wp.min(high, real(0.0))

    way_back = function(outside)

    def along_sides(k: int, i: int, back: vec3, mu: real, h: Held, b: Bodies, dt: real):
        """What friction takes on all sides."""
        u = b.v[i] * dt + b.correction[i]
        grip = h.grip[k]
        for a in range(3):
            if back[a] != real(0.0):  # a way into one side is no slip along another
                u[a] = real(0.0)
        total = vec3()
        for a in range(3):
            n = vec3()
            n[a] = real(1.0)
            limit = grip[a] + mu * wp.abs(back[a])
            taken = friction(u, n, limit)
            grip[a] = limit - wp.length(taken)
            total = total + taken
            u = u - taken
        h.grip[k] = grip
        return total

    rub = function(along_sides)

    @register
    def begin_box(
        first: int, parameters: wp.array(dtype=params), h: Held, b: Bodies, easing: Easing, dt: real
    ):
        k = first + wp.tid()
        i = h.particle[k]
        p = parameters[h.world[k]]
        R = h.radius[i]
        slack = h.slack[k]
        for a in range(3):
            s = slack[a]
            if h.marked[h.world[k]] != 0:
                # Where the substep began: the way since is no overlap.
                start = b.x[i][a] - dt * b.v[i][a]
                s = wp.abs(way_back(start, real(0.0), p.lower[a], p.upper[a], R, real(0.0)))
            if s > real(0.0):
                s = ease(s, R, dt, easing)
            slack[a] = s
        h.slack[k] = slack
        if p.friction > real(0.0):
            h.grip[k] = vec3()

    @register
    def project_box(
        first: int, parameters: wp.array(dtype=params), h: Held, b: Bodies, moving: real, dt: real
    ):
        k = first + wp.tid()
        i = h.particle[k]
        p = parameters[h.world[k]]
        x = b.x[i]
        e = vec3()
        if wp.static(compensated):
            e = b.x_error[i]
        dx = vec3()
        for a in range(3):
            slack = moving * h.slack[k][a]
            dx[a] = way_back(x[a], e[a], p.lower[a], p.upper[a], h.radius[i], slack)
        if moving * p.friction > real(0.0):
            dx = dx - rub(k, i, dx, p.friction, h, b, dt)
        touched = dx[0] != real(0.0) or dx[1] != real(0.0) or dx[2] != real(0.0)
        if touched and b.w[i] > real(0.0):
            place(i, x, e, dx, b)

    @register
    def bounce_box(
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
        p = parameters[h.world[k]]
        if p.restitution > real(0.0) and b.w[i] > real(0.0):
            c = b.correction[i]
            x = b.x[i]
            e = vec3()
            if wp.static(compensated):
                e = b.x_error[i]
            v = b.v[i]
            before = v - c * inverse_dt
            if wp.static(forces):
                before = before - f[i] * (b.w[i] * dt)
            for a in range(3):
                slack = h.slack[k][a]
                back = way_back(x[a] - c[a], e[a], p.lower[a], p.upper[a], h.radius[i], slack)
                inward = wp.where(back > real(0.0), real(1.0), real(-1.0))
                if back != real(0.0):
                    dv = rebound(before[a] * inward, v[a] * inward, p.restitution)
                    v[a] = v[a] + inward * dv
            b.v[i] = v

    return begin_box, project_box, bounce_box
