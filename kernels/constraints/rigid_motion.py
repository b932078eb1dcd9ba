"""Rigid motion of what particles meet: where it is at the time of a world."""

import functools
from types import SimpleNamespace
from typing import Any

import warp as wp

from ..precision import FLOAT64, Precision, function, register, structure


@functools.cache
def motion_type() -> Any:
    """What of a world moves, and how; in double precision, so that places stay exact."""
    names = ("velocity", "spin", "travel", "turn", "pivot")
    return structure("Motion_of_shape", {name: FLOAT64.vec3 for name in names})


@functools.cache
def pose_type(precision: Precision) -> Any:
    """Where a shape is: ``shift`` with what rounding keeps from it, and ``turn`` = R - 1.

    The velocity of its surface at x is ``velocity + spin x (x - hub)``.
    """
    names = ("shift", "shift_error", "pivot", "velocity", "spin", "hub")
    fields: dict[str, Any] = {name: precision.vec3 for name in names}
    fields["turn"] = turn_type(precision)
    return structure(f"Pose_{precision.name}", fields)


def turn_type(precision: Precision) -> Any:
    """A matrix (3, 3)."""
    return wp.types.matrix(shape=(3, 3), dtype=precision.scalar)


@functools.cache
def pose_kernel(precision: Precision) -> wp.Kernel:
    """Kernel: the poses of all worlds at their times.

    R - 1 = sin(theta) K + 2 sin^2(theta/2) K^2 (Rodrigues), K the cross product with the axis.
    """
    vec3, matrix = precision.vec3, turn_type(precision)
    Motion, Pose = motion_type(), pose_type(precision)

    def turned(spin: wp.vec3d, t: wp.float64):
        speed = wp.length(spin)
        K = wp.mat33d()
        if speed > wp.float64(0.0):
            K = wp.skew(spin / speed)
        s = wp.sin(wp.float64(0.5) * speed * t)
        return wp.sin(speed * t) * K + wp.float64(2.0) * s * s * (K * K)

    turn_by = function(turned)

    @register
    def place_shapes(
        first: int,
        motion: wp.array(dtype=Motion),
        time: wp.array(dtype=wp.float64),
        pose_out: wp.array(dtype=Pose),
    ):
        w = first + wp.tid()
        m = motion[w]
        t = time[w]
        p = Pose()
        exact = m.travel * t
        p.shift = vec3(exact)
        p.shift_error = vec3(exact - wp.vec3d(p.shift))
        p.turn = matrix(turn_by(m.turn, t))
        p.pivot = vec3(m.pivot)
        p.velocity = vec3(m.velocity)
        p.spin = vec3(m.spin)
        p.hub = vec3(m.pivot + m.velocity * t)
        pose_out[w] = p

    return place_shapes


@functools.cache
def frame_functions(precision: Precision) -> SimpleNamespace:
    """What a shape in motion makes of places and ways.

    - ``inward(x, e, p) -> (y, e)``: the place x + e as the shape sees it where it started;
    - ``outward(n, p)``: a direction back from there;
    - ``velocity(x, p)``: that of the surface at x;
    - ``way(x, u, dt, p)``: that of the surface in dt, under what came to x by u, halfway.

    Rest is exact: a shape that does not move gives the numbers that one without a pose gives.
    """
    vec3, real, Pose = precision.vec3, precision.scalar, pose_type(precision)

    def inward(x: vec3, e: vec3, p: Pose):
        y = x - p.shift
        rest = e - p.shift_error
        back = wp.transpose(p.turn)
        return y + back * (y - p.pivot), rest + back * rest

    def outward(n: vec3, p: Pose):
        return n + p.turn * n

    def velocity(x: vec3, p: Pose):
        return p.velocity + wp.cross(p.spin, x - p.hub)

    def way(x: vec3, u: vec3, dt: real, p: Pose):
        # Halfway, so that what sticks to a surface goes along circles and not along tangents.
        ahead = p.velocity * dt
        return ahead + wp.cross(p.spin, x - p.hub - (u - ahead) * real(0.5)) * dt

    return SimpleNamespace(
        inward=function(inward), outward=function(outward), velocity=function(velocity),
        way=function(way),
    )  # fmt: skip
