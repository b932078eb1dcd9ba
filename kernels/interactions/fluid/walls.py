"""Walls of a fluid: how far they are from its particles, and along which normals."""

import functools
from typing import Any, NamedTuple

import warp as wp

from ...constraints.rigid_motion import frame_functions, pose_type
from ...engine.atomics import rise_function
from ...engine.easing import ease_function, easing_type
from ...engine.loops import Pairs
from ...precision import Precision, function, register, structure

FAR = 100.0  # times the reach: where no wall is


class Surface(NamedTuple):
    """What the kernel of a wall is made for.

    Args:
        facing: Its sides (see ``kernels.constraints.walls``).
        places: Of every side the place that it takes; of those that share one the nearest counts.
        total: Places of all walls.
        precision: Of the simulation.
        params: Struct of the surface's parameters.
        moving: It has poses.
        sticky: The fluid sticks to it.
        dimension: Of the fluid: what closes a plane or a line in from its sides is no wall of it.
    """

    facing: wp.Function
    places: tuple[int, ...]
    total: int
    precision: Precision
    params: Any
    moving: bool
    sticky: bool
    dimension: int


def normals_of(precision: Precision, total: int) -> Any:
    """A normal for each place."""
    return wp.types.matrix(shape=(total, 3), dtype=precision.scalar)


@functools.cache
def near_type(precision: Precision, total: int) -> Any:
    """What is known of walls around every slot, and which clusters of slots are near one."""
    each = precision.vector(total)
    fields = {
        "distance": wp.array(dtype=each),
        "rate": wp.array(dtype=each),  # at which it grows; empty where nobody asks
        "against": wp.array(dtype=precision.vec3),  # velocity to the nearest that holds; or empty
        "normal": wp.array(dtype=normals_of(precision, total)),
        "near": wp.array(dtype=wp.int32),  # cluster -> how many places, 2 for more
    }
    return structure(f"Near{total}_{precision.name}", fields)


@functools.cache
def nowhere_kernel(precision: Precision, total: int, fluid: Any) -> wp.Kernel:
    """Kernel: no wall is near."""
    each, normals, real = precision.vector(total), normals_of(precision, total), precision.scalar
    Near, vec3 = near_type(precision, total), precision.vec3

    @register
    def no_wall(
        first: int, pairs: Pairs, fluids: wp.array(dtype=fluid), v: wp.array(dtype=vec3), o: Near
    ):  # fmt: skip
        i = first + wp.tid()
        far = real(FAR) * wp.sqrt(fluids[pairs.world[i]].cutoff_squared)
        d = each()
        for a in range(wp.static(total)):
            d[a] = far
        o.distance[i] = d
        o.normal[i] = normals()
        if o.rate.shape[0] > 0:
            o.rate[i] = each()
        if o.against.shape[0] > 0:
            o.against[i] = v[i]

    return no_wall


@functools.cache
def sight_function(surface: Surface) -> wp.Function:
    """``sight(x, p, pose, w) -> (d, N)``: sides of a wall as a particle at x sees them.

    Those that are none of it are infinitely far.
    """
    facing, places, _total, precision, params, moving, _sticky, dimension = surface
    vec3, real, sides = precision.vec3, precision.scalar, len(places)
    each, normals = precision.vector(sides), normals_of(precision, sides)
    Pose, frame = pose_type(precision), frame_functions(precision)
    inward, outward = frame.inward, frame.outward

    def sight(x: vec3, p: params, pose: wp.array(dtype=Pose), w: int):
        y = x
        if wp.static(moving):
            y, _rest = inward(y, vec3(), pose[w])
        found, N = facing(y, p)
        d = each(found)
        turned = normals(N)
        for a in range(wp.static(sides)):
            n = vec3(N[a, 0], N[a, 1], N[a, 2])
            if wp.static(moving):
                n = outward(n, pose[w])
                for c in range(3):
                    turned[a, c] = n[c]
            if wp.static(dimension == 2):
                d[a] = wp.where(n[2] * n[2] > real(0.5), real(wp.inf), d[a])
            if wp.static(dimension == 1):
                d[a] = wp.where(n[0] * n[0] < real(0.5), real(wp.inf), d[a])
        return d, turned

    return function(sight, after_gradients=True)


@functools.cache
def distance_kernel(surface: Surface) -> wp.Kernel:
    """Kernel: how far the sides of a wall, moved by their slack, are from every slot it holds."""
    _facing, places, total, precision, params, moving, sticky, _dimension = surface
    vec3, real, each = precision.vec3, precision.scalar, precision.vector(total)
    normals, Near, Pose = (
        normals_of(precision, total), near_type(precision, total), pose_type(precision),
    )  # fmt: skip
    velocity, sight = frame_functions(precision).velocity, sight_function(surface)
    sides = len(places)
    place_of = wp.constant(wp.types.vector(length=sides, dtype=wp.int32)(*places))

    @register
    def look_at_wall(
        first: int,
        pairs: Pairs,
        parameters: wp.array(dtype=params),
        pose: wp.array(dtype=Pose),
        held: wp.array(dtype=wp.int32),
        x: wp.array(dtype=vec3),
        v: wp.array(dtype=vec3),
        begin: int,
        stride: int,
        slack: wp.array(dtype=wp.float32),
        closing: wp.array(dtype=wp.float32),
        o: Near,
    ):
        i = first + wp.tid()
        if held[pairs.order[i]] != 0:
            w = pairs.world[i]
            d, N = sight(x[i], parameters[w], pose, w)
            own = each(o.distance[i])
            n_own, rate = normals(o.normal[i]), each()
            rated = o.rate.shape[0] > 0
            if rated:
                rate = each(o.rate[i])
            for a in range(wp.static(sides)):
                k = place_of[a]
                away = d[a] + real(slack[w * stride + begin + a])
                if away < own[k]:
                    nearest = away < wp.min(own)
                    own[k] = wp.max(away, real(0.0))
                    n = vec3(N[a, 0], N[a, 1], N[a, 2])
                    for c in range(3):
                        n_own[k, c] = n[c]
                    if rated:
                        u = v[i]
                        if wp.static(moving):
                            u = u - velocity(x[i], pose[w])
                        rate[k] = wp.dot(u, n)
                        if closing.shape[0] > 0:
                            rate[k] += real(closing[w * stride + begin + a])
                        if wp.static(sticky):
                            if nearest:
                                o.against[i] = u
            o.distance[i] = own
            o.normal[i] = n_own
            if rated:
                o.rate[i] = rate

    return look_at_wall


@functools.cache
def near_kernel(precision: Precision, total: int, alike: bool, fluid: Any) -> wp.Kernel:
    """Kernel: how many places have a wall that is nearer to a cluster than the reach.

    Unless they are ``alike`` one counts as several.
    """
    Near = near_type(precision, total)

    @register
    def mark_near(first: int, pairs: Pairs, fluids: wp.array(dtype=fluid), o: Near):
        c = first + wp.tid()
        begin = pairs.lead[c]
        reach = wp.sqrt(fluids[pairs.world[begin]].cutoff_squared)
        found = int(0)
        for a in range(wp.static(total)):
            near = int(0)
            for i in range(begin, pairs.lead[c + 1]):
                if o.distance[i][a] < reach:
                    near = 1
            found += near
        if wp.static(not alike):
            found *= 2
        o.near[c] = wp.min(found, 2)

    return mark_near


@functools.cache
def overlap_kernel(surface: Surface) -> wp.Kernel:
    """Kernel: by how much more than they rest at particles start nearer to the sides of a wall.

    In worlds that are marked; ``rest`` is by world, ``slack`` by world and side from ``begin`` on.
    At most a side gives way by twice that.
    """
    _facing, places, _total, precision, params, _moving, _sticky, _dimension = surface
    vec3, real, Pose = precision.vec3, precision.scalar, pose_type(precision)
    sides, rise, sight = len(places), rise_function(), sight_function(surface)

    @register
    def find_overlap(
        first: int,
        pairs: Pairs,
        parameters: wp.array(dtype=params),
        pose: wp.array(dtype=Pose),
        held: wp.array(dtype=wp.int32),
        x: wp.array(dtype=vec3),
        marked: wp.array(dtype=wp.int32),
        rest: wp.array(dtype=real),
        begin: int,
        stride: int,
        slack_io: wp.array(dtype=wp.float32),
    ):
        i = first + wp.tid()
        w = pairs.world[i]
        if marked[w] != 0 and held[pairs.order[i]] != 0:
            d, _N = sight(x[i], parameters[w], pose, w)
            for a in range(wp.static(sides)):
                overlap = wp.min(rest[w] - d[a], real(2.0) * rest[w])
                if overlap > real(0.0):
                    rise(w * stride + begin + a, wp.float32(overlap), slack_io)

    return find_overlap


@functools.cache
def forget_kernel() -> wp.Kernel:
    """Kernel: the slack of worlds that are marked is none."""

    @register
    def forget_slack(
        first: int, marked: wp.array(dtype=wp.int32), stride: int,
        slack_io: wp.array(dtype=wp.float32),
    ):  # fmt: skip
        k = first + wp.tid()
        if marked[k / stride] != 0:
            slack_io[k] = 0.0

    return forget_slack


@functools.cache
def ease_kernel(precision: Precision) -> wp.Kernel:
    """Kernel: slack runs out; at which rate is kept where somebody asks."""
    real = precision.scalar
    ease, Easing = ease_function(precision), easing_type(precision)

    @register
    def ease_slack(
        first: int,
        rest: wp.array(dtype=real),
        easing: Easing,
        dt: real,
        stride: int,
        slack_io: wp.array(dtype=wp.float32),
        closing_out: wp.array(dtype=wp.float32),
    ):
        k = first + wp.tid()
        slack = slack_io[k]
        if slack > 0.0:
            slack_io[k] = wp.float32(ease(real(slack), rest[k / stride], dt, easing))
        if closing_out.shape[0] > 0:
            closing_out[k] = (slack_io[k] - slack) / wp.float32(dt)

    return ease_slack
