"""Targets of single particles, which move between keyframes by the clock of their world."""

import functools
from typing import Any

import warp as wp

from ...precision import APART, Precision, function, register
from ..constraints import positions_type


@wp.struct
class Keyframes:
    """Of each row: its world, its times and its places."""

    world: wp.array(dtype=wp.int32)
    count: wp.array(dtype=wp.int32)  # of keyframes
    clock: wp.array(dtype=wp.int32)  # the first of its ``time``
    first: wp.array(dtype=wp.int32)  # the first of its ``place``
    time: wp.array(dtype=wp.float64)
    place: wp.array(dtype=wp.vec3d)


def attachment_evaluation(precision: Precision, item: Any) -> wp.Function:
    """C = |x - target|. At the target it is pulled along a fixed direction: its force is known."""
    real, vec3, positions = precision.scalar, precision.vec3, positions_type(precision, 1)
    apart = vec3(*APART)

    def attachment_constraint(X: positions, q: item):
        d = X[0] - q.target
        r = wp.length(d)
        away = r > real(0.0)
        n = wp.where(away, d / wp.where(away, r, real(1.0)), apart)
        G = positions()
        G[0] = n
        return r, G

    return function(attachment_constraint)


@functools.cache
def follow_kernel(precision: Precision, item: Any) -> wp.Kernel:
    """Kernel: ``target`` of each row at the present time; before and after all keyframes it rests.

    In double precision, and rounded once: a target does not drift, however many substeps led there.
    """
    vec3, real, double = precision.vec3, precision.scalar, wp.float64

    @register
    def follow_keyframes(
        first: int, keys: Keyframes, time: wp.array(dtype=wp.float64), q: wp.array(dtype=item)
    ):
        r = first + wp.tid()
        t = time[keys.world[r]]
        low = int(0)
        high = keys.count[r] - 1
        while high - low > 1:
            middle = (low + high) // 2
            if keys.time[keys.clock[r] + middle] <= t:
                low = middle
            else:
                high = middle
        begin = keys.time[keys.clock[r] + low]
        span = keys.time[keys.clock[r] + high] - begin
        part = double(0.0)
        if span > double(0.0):
            part = wp.clamp((t - begin) / span, double(0.0), double(1.0))
        a = keys.place[keys.first[r] + low]
        p = a + (keys.place[keys.first[r] + high] - a) * part
        here = q[r]
        here.target = vec3(real(p[0]), real(p[1]), real(p[2]))
        q[r] = here

    return follow_keyframes
