"""XPBD on given tuples: the sweep that corrects all tuples of a colour.

It is built twice: by :func:`plain_sweep`, the reference, for CUDA; and for the CPU by
:func:`~particlesim.kernels.constraints.native_sweep.native_sweep`, in C++ that corrects as many
tuples at once as the vector units have lanes. Tuples of one colour share no particle, and no sum
is taken across them: both give the same bits.
"""

import functools

import warp as wp

from ..precision import function, register
from .constraints import Solved, place_function
from .correction import evaluate_function, load_function, multiply_function
from .native_sweep import group, native_sweep

BLOCK = 64  # tuples that a thread of the CPU sweeps


def plain_sweep(law: Solved) -> wp.Function:
    """``sweep(first, last, fresh, box, t, b, dt, inverse_dt)``: rows from first to last.

    In Warp's own language. ``fresh``: multipliers start from 0, whatever they were.
    """
    real, Box, Tuples, Bodies = law.types
    load, evaluate, multiply = load_function(law), evaluate_function(law), multiply_function(law)
    place = place_function(law.precision, law.compensated)
    size, wraps, breakable = law.size, bool(law.periodic), law.breakable

    def sweep_plainly(
        first: int, last: int, fresh: int, box: wp.array(dtype=Box), t: Tuples, b: Bodies,
        dt: real, inverse_dt: real,
    ):  # fmt: skip
        for r in range(first, last):
            if fresh != 0:
                t.lam[r] = real(0.0)
            if wp.static(breakable):
                if t.broken[r] != 0:
                    continue
            ids = t.particle[r]
            q = t.item[r]
            x, e, c, v, w = load(ids, b)
            B = Box()
            if wp.static(wraps):
                B = box[t.world[r]]
            C, G, H, extent = evaluate(x, e, c, v, q, B, dt)
            lam, good, dx = multiply(C, G, H, extent, w, t.lam[r], q, b.unit, b.most, inverse_dt)
            if good:
                t.lam[r] = lam
                for a in range(wp.static(size)):
                    place(ids[a], x[a], e[a], dx[a], b)

    return function(sweep_plainly, after_gradients=True)


def lane_sweep(law: Solved) -> wp.Function:
    """The same sweep on the CPU: groups of tuples natively, and those that fill none plainly."""
    real, Box, Tuples, Bodies = law.types
    natively, plainly, size = native_sweep(law), plain_sweep(law), group(law)

    def sweep_in_lanes(
        first: int, last: int, fresh: int, box: wp.array(dtype=Box), t: Tuples, b: Bodies,
        dt: real, inverse_dt: real,
    ):  # fmt: skip
        whole = last - (last - first) % wp.static(size)
        natively(first, whole, fresh, box, t, b, dt, inverse_dt)
        plainly(whole, last, fresh, box, t, b, dt, inverse_dt)

    return function(sweep_in_lanes, after_gradients=True)


@functools.cache
def project_kernel(law: Solved, vectorised: bool) -> wp.Kernel:
    """Kernel: one sweep over the tuples of a colour, those from ``start`` to ``end``.

    A thread sweeps ``BLOCK`` of them where it is vectorised, else one. The first sweep of a substep
    starts from multipliers of 0, and has ``scale`` = 1 / dt^2 kept for reports; else it is below 0.
    """
    real, Box, Tuples, Bodies = law.types
    sweep = (lane_sweep if vectorised else plain_sweep)(law)
    block = BLOCK if vectorised else 1

    @functools.partial(register, cpu_only=vectorised)
    def project_tuples(
        first: int,
        start: int,
        end: int,
        scale: wp.float64,
        box: wp.array(dtype=Box),
        t: Tuples,
        b: Bodies,
        dt: real,
        inverse_dt: real,
    ):
        r = start + (first + wp.tid()) * wp.static(block)
        fresh = int(scale >= wp.float64(0.0))
        if fresh != 0 and r == 0:
            t.scale[0] = scale
        sweep(r, wp.min(r + wp.static(block), end), fresh, box, t, b, dt, inverse_dt)

    return project_tuples
