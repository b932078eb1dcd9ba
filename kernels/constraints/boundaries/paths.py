"""Given motions of what particles meet: where it is at a time, and how fast.

A path is a Warp function ``path(m, t) -> (T, A)`` of its parameters and the time, in double
precision: the way of the pivot, and the turn about it, less 1. The velocity is its derivative, by a
central difference over what is short against a frame.
"""

import functools
from typing import Any

import warp as wp

from ...precision import FLOAT64, Precision, function, function_from_source, register
from ..rigid_motion import pose_type, turn_type

SHORT = 2.0**-10  # of a frame


@functools.cache
def turned_function() -> wp.Function:
    """``turned(r)``: the rotation by a vector, less 1: sin K + 2 sin^2(half) K^2 (Rodrigues)."""
    real = wp.float64

    def turned(r: wp.vec3d):
        angle = wp.length(r)
        K = wp.mat33d()
        if angle > real(0.0):
            K = wp.skew(r / angle)
        s = wp.sin(real(0.5) * angle)
        return wp.sin(angle) * K + real(2.0) * s * s * (K * K)

    return function(turned)


@functools.cache
def law_path(
    place: wp.Function | None, turn: wp.Function | None, names: tuple[tuple[str, ...], ...],
    params: Any,
) -> wp.Function:  # fmt: skip
    """A path of two laws of time: the way, and the rotation vector."""
    given = [", ".join(["t", *(f"m.{name}" for name in each)]) for each in names]
    way = "wp.vec3d()" if place is None else f"place({given[0]})"
    vector = "wp.vec3d()" if turn is None else f"turn({given[1]})"
    source = (
        "def along_laws(m: Params, t: wp.float64):\n"
        f"    return {way}, turned({vector})\n"
    )  # fmt: skip
    namespace: dict[str, Any] = {"wp": wp, "Params": params, "turned": turned_function()}
    laws = {"place": place, "turn": turn}
    namespace |= {name: law for name, law in laws.items() if law is not None}
    return function_from_source(source, namespace)


@functools.cache
def key_path(params: Any) -> wp.Function:
    """A path of cubic pieces: ways, and rotation vectors from the turn that each begins with."""
    real = wp.float64
    turned = turned_function()

    def along_keys(m: params, t: wp.float64):
        last = m.times.shape[0] - 1
        k = int(0)
        high = int(last)
        while high - k > 1:
            middle = (k + high) // 2
            if t < m.times[middle]:
                high = middle
            else:
                k = middle
        length = m.times[k + 1] - m.times[k]
        s = wp.clamp((t - m.times[k]) / length, real(0.0), real(1.0))
        way = m.ways[k, 0] + s * (m.ways[k, 1] + s * (m.ways[k, 2] + s * m.ways[k, 3]))
        r = s * (m.turns[k, 0] + s * (m.turns[k, 1] + s * m.turns[k, 2]))
        A = m.starts[k]
        B = turned(r)
        return way, A + B + A * B

    return function(along_keys)


@functools.cache
def path_kernel(path: wp.Function, precision: Precision, params: Any) -> wp.Kernel:
    """Kernel: the poses of all worlds at their times."""
    vec3, matrix, Pose = precision.vec3, turn_type(precision), pose_type(precision)
    real = FLOAT64.scalar

    @register
    def place_along(
        first: int,
        motion: wp.array(dtype=params),
        time: wp.array(dtype=real),
        pose_out: wp.array(dtype=Pose),
    ):
        w = first + wp.tid()
        m = motion[w]
        t = time[w]
        before = wp.max(t - m.instant, real(0.0))
        after = t + m.instant
        way, turn = path(m, t)
        way0, turn0 = path(m, before)
        way1, turn1 = path(m, after)
        over = real(1.0) / (after - before)
        # dR/dt R^T is the cross product with the angular velocity.
        W = (turn1 - turn0) * over
        W = W + W * wp.transpose(turn)
        spin = wp.vec3d(W[2, 1] - W[1, 2], W[0, 2] - W[2, 0], W[1, 0] - W[0, 1]) * real(0.5)
        p = Pose()
        p.shift = vec3(way)
        p.shift_error = vec3(way - wp.vec3d(p.shift))
        p.turn = matrix(turn)
        p.pivot = vec3(m.pivot)
        p.velocity = vec3((way1 - way0) * over)
        p.spin = vec3(spin)
        p.hub = vec3(m.pivot + way)
        pose_out[w] = p

    return place_along
