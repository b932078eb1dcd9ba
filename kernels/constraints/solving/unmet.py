"""By how much tuples are missed, in parts of their extent."""

import functools

import warp as wp

from ...precision import function, register
from ..constraints import Solved, positions_type, view_function


def off_function(law: Solved) -> wp.Function:
    """``off(X, C, G, lack)``: ``lack``, what C is off by, over |grad C| and the tuple's extent."""
    real, positions, size = law.precision.scalar, positions_type(law.precision, law.size), law.size

    def off(X: positions, G: positions, lack: wp.float64):
        extent = real(0.0)
        slope = real(0.0)
        for a in range(wp.static(size)):
            extent = wp.max(extent, wp.length(X[a] - X[0]))
            slope = slope + wp.length_sq(G[a])
        result = wp.float64(0.0)
        if lack > wp.float64(0.0):
            result = lack / wp.float64(wp.sqrt(slope) * extent)
        return real(result)

    return function(off)


def lack_function(law: Solved) -> wp.Function:
    """``lack(r, C, F, t)``: |C + alpha F|, of an inequality below 0 only, of a broken one 0."""
    real, _, Tuples, _ = law.types
    one_sided, breakable = law.one_sided, law.breakable

    def lack(r: int, C: real, F: wp.float64, t: Tuples):
        miss = wp.abs(wp.float64(C) + wp.float64(t.item[r].compliance) * F)
        if wp.static(one_sided):
            miss = wp.where(C >= real(0.0), wp.float64(0.0), miss)
        if wp.static(breakable):
            if t.broken[r] != 0:
                miss = wp.float64(0.0)
        return miss

    return function(lack)


@functools.cache
def unmet_kernel(law: Solved) -> wp.Kernel:
    """Kernel: the flag is set if a tuple is off by more than a tolerance in its present sweep."""
    real, Box, Tuples, Bodies = law.types
    view, off, lack = view_function(law), off_function(law), lack_function(law)

    @register
    def find_unmet(
        first: int, box: wp.array(dtype=Box), t: Tuples, b: Bodies, tolerance: real,
        flag_out: wp.array(dtype=wp.int32),
    ):  # fmt: skip
        r = first + wp.tid()
        X, C, G = view(r, box, t, b)
        w = real(0.0)
        for a in range(wp.static(law.size)):
            w += b.w[t.particle[r][a]]
        F = wp.float64(t.lam[r]) * t.scale[0] * wp.float64(b.unit)
        if w > real(0.0) and off(X, G, lack(r, C, F, t)) > tolerance:
            flag_out[0] = 1

    return find_unmet
