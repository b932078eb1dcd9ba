"""Rest values of tuples that flow where these are strained beyond a yield."""

import functools
from typing import Any

import warp as wp

from ...precision import Precision, function_from_source, register
from ..constraints import Solved, view_function

double = wp.float64


def _put_function(precision: Precision, item: Any, rest: str) -> wp.Function:
    """``put(q, value) -> q``: a tuple's parameters with this rest value, rounded once."""
    source = f"def put(q: Item, value: wp.float64):\n    q.{rest} = real(value)\n    return q\n"
    namespace = {"wp": wp, "Item": item, "real": precision.scalar}
    return function_from_source(source, namespace)


@functools.cache
def follow_kernel(precision: Precision, item: Any, rest: str) -> wp.Kernel:
    """Kernel: the rest value of each row is that of the start and what has been added for good."""
    put = _put_function(precision, item, rest)

    @register
    def follow_flow(
        first: int, flow: wp.array(dtype=wp.vec4d), permanent: wp.array(dtype=wp.float64),
        q: wp.array(dtype=item),
    ):  # fmt: skip
        r = first + wp.tid()
        q[r] = put(q[r], flow[r][0] + permanent[r])

    return follow_flow


@functools.cache
def creep_kernel(law: Solved, sense: int) -> wp.Kernel:
    """Kernel: what is beyond the yield goes over into the rest value, at the rate of the creep.

    p += (1 - exp(-creep dt)) (s - clamp(s, -y, y)), s = ``sense`` C, and |p| <= most: the solution
    of dp/dt = creep (s - y) where the tuple is held. ``flow`` has the rest value at the start, y,
    the creep, and most. An inequality flows where it holds.
    """
    real, Box, Tuples, Bodies = law.types
    view, one_sided, breakable = view_function(law), law.one_sided, law.breakable

    @register
    def creep_tuples(
        first: int, box: wp.array(dtype=Box), t: Tuples, b: Bodies, dt: wp.float64,
        flow: wp.array(dtype=wp.vec4d), permanent_io: wp.array(dtype=wp.float64),
    ):  # fmt: skip
        r = first + wp.tid()
        if wp.static(breakable):
            if t.broken[r] != 0:
                return
        _X, C, _G = view(r, box, t, b)
        if wp.static(one_sided):
            if C >= real(0.0):
                return
        f = flow[r]
        s = wp.float64(C) * wp.static(wp.float64(sense))
        beyond = s - wp.clamp(s, -f[1], f[1])
        share = wp.static(double(1.0)) - wp.exp(-f[2] * dt)
        permanent_io[r] = wp.clamp(permanent_io[r] + share * beyond, -f[3], f[3])

    return creep_tuples
