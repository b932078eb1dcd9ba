"""Where particles meet a boundary: its surface at the place where that is."""

import functools
from typing import Any, NamedTuple

import warp as wp

from ...precision import Precision, function, structure
from ..rigid_motion import frame_functions, pose_type


class Form(NamedTuple):
    """What the kernels of a boundary are made for.

    Args:
        surface: Where it is (see ``boundary_shapes``).
        sides: At most how many of its sides a particle touches at once.
        precision: Of the simulation.
        params: Struct of what the surface takes, with friction and restitution.
        compensated: Positions come with what rounding has kept from them.
        moving: It has poses.
        tracked: The surface takes where the substep began, too.
        touch: Friction and restitution by place (see ``combined``); None: they are the boundary's.
    """

    surface: wp.Function
    sides: int
    precision: Precision
    params: Any
    compensated: bool
    moving: bool
    tracked: bool
    touch: wp.Function | None


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
        "came": wp.array(dtype=each),  # speeds at which they have hit, 0: not; empty like grip
        "impulse": wp.array(dtype=each),  # that have sent them off so far, over their masses
        "pressed": wp.array(dtype=precision.vec3),  # how far it has moved them in a substep
        "pose": wp.array(dtype=pose_type(precision)),  # by world; empty where nothing moves
        # By particle, where the substep began, as the shape sees it; empty unless asked for.
        "start": wp.array(dtype=precision.vec3),
    }
    return structure(f"Held{sides}_{precision.name}", fields)


@functools.cache
def meeting_function(form: Form) -> wp.Function:
    """``meet(i, w, x, e, slack, p, h) -> (back, N)``: what particle i at x + e meets in world w.

    The way back to each side, and the sides' normals (see ``boundary_shapes``).
    """
    surface, sides, precision, params, _, moving, tracked, _ = form
    vec3, each, Held = precision.vec3, precision.vector(sides), held_type(precision, sides)
    frame = frame_functions(precision)
    inward, outward = frame.inward, frame.outward

    def meet(i: int, w: int, x: vec3, e: vec3, slack: each, p: params, h: Held):
        y = x
        rest = e
        if wp.static(moving):
            y, rest = inward(y, rest, h.pose[w])
        if wp.static(tracked):
            back, N = surface(y, rest, h.radius[i], slack, h.start[i], p)
        else:
            back, N = surface(y, rest, h.radius[i], slack, p)
        if wp.static(moving):
            for a in range(wp.static(sides)):
                N[a] = outward(N[a], h.pose[w])
        return back, N

    # Emitted behind the surface, which may itself stand behind the gradient that it takes.
    return function(meet, after_gradients=True)


@functools.cache
def touching_function(form: Form) -> wp.Function:
    """``touching(i, w, x, e, p, h) -> (mu, e)``: friction and restitution where i meets it."""
    precision, params, touch = form.precision, form.params, form.touch
    vec3, Held = precision.vec3, held_type(precision, form.sides)
    inward, moving, tracked = frame_functions(precision).inward, form.moving, form.tracked
    if touch is None:

        def touching_one(i: int, w: int, x: vec3, e: vec3, p: params, h: Held):
            return p.friction, p.restitution

        return function(touching_one)

    def touching(i: int, w: int, x: vec3, e: vec3, p: params, h: Held):
        y = x
        rest = e
        if wp.static(moving):
            y, rest = inward(y, rest, h.pose[w])
        start = y
        if wp.static(tracked):
            start = h.start[i]
        mu, e_n = touch(y, rest, start, p)
        return mu, e_n

    return function(touching, after_gradients=True)


@functools.cache
def seen_function(form: Form) -> wp.Function:
    """``seen(x, w, h)``: the place x as the shape sees it where it started."""
    precision, moving = form.precision, form.moving
    vec3, Held = precision.vec3, held_type(precision, form.sides)
    inward = frame_functions(precision).inward

    def seen(x: vec3, w: int, h: Held):
        y = x
        if wp.static(moving):
            y, _rest = inward(y, vec3(), h.pose[w])
        return y

    return function(seen)


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
