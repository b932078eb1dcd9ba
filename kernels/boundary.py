"""Boundaries: planes and boxes that particles stay inside of, by their radius."""

import functools
from typing import Any

import warp as wp

from .constraints import bodies_type, place_function
from .easing import ease_function, easing_type
from .precision import Precision, function, register


@functools.cache
def friction_function(precision: Precision) -> wp.Function:
    """``grip(u, n, d, mu)``: what friction takes back of the way u, at a normal correction d > 0.

    All of the tangential way if it is no more than mu d, else mu d of it (Macklin et al. 2014,
    eq. 24, with one coefficient).
    """
    vec3, real = precision.vec3, precision.scalar

    def grip(u: vec3, n: vec3, d: real, mu: real):
        t = u - n * wp.dot(u, n)
        length = wp.length(t)
        factor = real(1.0)
        if length > mu * d:
            factor = mu * d / length
        return t * factor

    return function(grip)


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
    """Kernels of a half space (x - point) . n >= R: slack, projection, bounce."""
    vec3, real = precision.vec3, precision.scalar
    Bodies, Easing = bodies_type(precision), easing_type(precision)
    place, ease = place_function(precision, compensated), ease_function(precision)
    friction, rebound = friction_function(precision), bounce_function(precision)

    def height(i: int, p: params, b: Bodies):
        d = b.x[i] - p.point
        if wp.static(compensated):
            d = d + b.x_error[i]
        return wp.dot(d, p.normal)

    above = function(height)

    @register
    def ease_plane(
        first: int,
        members: wp.array(dtype=wp.int32),
        world: wp.array(dtype=wp.int32),
        parameters: wp.array(dtype=params),
        marked: wp.array(dtype=wp.int32),
        radius: wp.array(dtype=real),
        b: Bodies,
        easing: Easing,
        dt: real,
        slack_io: wp.array(dtype=real),
    ):
        k = first + wp.tid()
        i = members[k]
        w = world[k]
        s = slack_io[k]
        if marked[w] != 0:
            # Where the substep began: the way since is no overlap.
            start = above(i, parameters[w], b) - dt * wp.dot(b.v[i], parameters[w].normal)
            s = wp.max(radius[i] - start, real(0.0))
        if s > real(0.0):
            s = ease(s, radius[i], dt, easing)
        slack_io[k] = s

    @register
    def project_plane(
        first: int,
        members: wp.array(dtype=wp.int32),
        world: wp.array(dtype=wp.int32),
        parameters: wp.array(dtype=params),
        slack: wp.array(dtype=real),
        radius: wp.array(dtype=real),
        b: Bodies,
        moving: real,
        dt: real,
    ):
        k = first + wp.tid()
        i = members[k]
        p = parameters[world[k]]
        d = radius[i] - moving * slack[k] - above(i, p, b)
        if d > real(0.0) and b.w[i] > real(0.0):
            dx = p.normal * d
            if p.friction > real(0.0):
                u = b.v[i] * dt + b.correction[i] * moving
                dx = dx - friction(u, p.normal, d, p.friction)
            e = vec3()
            if wp.static(compensated):
                e = b.x_error[i]
            place(i, b.x[i], e, dx, b)

    @register
    def bounce_plane(
        first: int,
        members: wp.array(dtype=wp.int32),
        world: wp.array(dtype=wp.int32),
        parameters: wp.array(dtype=params),
        slack: wp.array(dtype=real),
        radius: wp.array(dtype=real),
        b: Bodies,
        f: wp.array(dtype=vec3),
        dt: real,
        inverse_dt: real,
    ):
        k = first + wp.tid()
        i = members[k]
        p = parameters[world[k]]
        c = b.correction[i]
        integrated = above(i, p, b) - wp.dot(c, p.normal)
        if p.restitution > real(0.0) and integrated < radius[i] - slack[k] and b.w[i] > real(0.0):
            v = b.v[i]
            before = v - c * inverse_dt
            if wp.static(forces):
                before = before - f[i] * (b.w[i] * dt)
            dv = rebound(wp.dot(before, p.normal), wp.dot(v, p.normal), p.restitution)
            b.v[i] = v + p.normal * dv

    return ease_plane, project_plane, bounce_plane


@functools.cache
def box_kernels(
    precision: Precision, params: Any, compensated: bool, forces: bool
) -> tuple[wp.Kernel, wp.Kernel, wp.Kernel]:
    """Kernels of the inside of a box, lower + R <= x <= upper - R: slack, projection, bounce.

    Slack is by axis. Where the box is too narrow for a particle, the middle is right.
    """
    vec3, real = precision.vec3, precision.scalar
    Bodies, Easing = bodies_type(precision), easing_type(precision)
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

    @register
    def ease_box(
        first: int,
        members: wp.array(dtype=wp.int32),
        world: wp.array(dtype=wp.int32),
        parameters: wp.array(dtype=params),
        marked: wp.array(dtype=wp.int32),
        radius: wp.array(dtype=real),
        b: Bodies,
        easing: Easing,
        dt: real,
        slack_io: wp.array(dtype=vec3),
    ):
        k = first + wp.tid()
        i = members[k]
        p = parameters[world[k]]
        R = radius[i]
        slack = slack_io[k]
        for a in range(3):
            s = slack[a]
            if marked[world[k]] != 0:
                # Where the substep began: the way since is no overlap.
                start = b.x[i][a] - dt * b.v[i][a]
                s = wp.abs(way_back(start, real(0.0), p.lower[a], p.upper[a], R, real(0.0)))
            if s > real(0.0):
                s = ease(s, R, dt, easing)
            slack[a] = s
        slack_io[k] = slack

    @register
    def project_box(
        first: int,
        members: wp.array(dtype=wp.int32),
        world: wp.array(dtype=wp.int32),
        parameters: wp.array(dtype=params),
        slack: wp.array(dtype=vec3),
        radius: wp.array(dtype=real),
        b: Bodies,
        moving: real,
        dt: real,
    ):
        k = first + wp.tid()
        i = members[k]
        p = parameters[world[k]]
        x = b.x[i]
        e = vec3()
        if wp.static(compensated):
            e = b.x_error[i]
        back = vec3()
        for a in range(3):
            s = moving * slack[k][a]
            back[a] = way_back(x[a], e[a], p.lower[a], p.upper[a], radius[i], s)
        if wp.dot(back, back) > real(0.0) and b.w[i] > real(0.0):
            dx = back
            if p.friction > real(0.0):
                u = b.v[i] * dt + b.correction[i] * moving
                for a in range(3):
                    if back[a] != real(0.0):  # a way into one side is no slip along another
                        u[a] = real(0.0)
                for a in range(3):
                    n = vec3()
                    n[a] = real(1.0)
                    taken = friction(u, n, wp.abs(back[a]), p.friction)
                    dx = dx - taken
                    u = u - taken
            place(i, x, e, dx, b)

    @register
    def bounce_box(
        first: int,
        members: wp.array(dtype=wp.int32),
        world: wp.array(dtype=wp.int32),
        parameters: wp.array(dtype=params),
        slack: wp.array(dtype=vec3),
        radius: wp.array(dtype=real),
        b: Bodies,
        f: wp.array(dtype=vec3),
        dt: real,
        inverse_dt: real,
    ):
        k = first + wp.tid()
        i = members[k]
        p = parameters[world[k]]
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
                back = way_back(x[a] - c[a], e[a], p.lower[a], p.upper[a], radius[i], slack[k][a])
                inward = wp.where(back > real(0.0), real(1.0), real(-1.0))
                if back != real(0.0):
                    dv = rebound(before[a] * inward, v[a] * inward, p.restitution)
                    v[a] = v[a] + inward * dv
            b.v[i] = v

    return ease_box, project_box, bounce_box
