"""XPBD on given tuples, all of them at once (Jacobi)."""

import functools

import warp as wp

from ...precision import register
from ..constraint_force import Seats
from ..constraints import Solved, place_function, positions_type, rounding_function
from ..correction import evaluate_function, load_function, multiply_function


@functools.cache
def step_kernel(law: Solved) -> wp.Kernel:
    """Kernel: multipliers of all tuples, and how far each would have its particles go.

    A particle of n tuples counts as n times as light in each (Tonge, Benevolenski and Voroshilov
    2012): steps of a tuple stay opposite and equal, and all of them together never overshoot.
    """
    real, Box, Tuples, Bodies = law.types
    load, evaluate, multiply = load_function(law), evaluate_function(law), multiply_function(law)
    positions, shares = positions_type(law.precision, law.size), law.precision.vector(law.size)
    size, wraps, breakable = law.size, bool(law.periodic), law.breakable

    @register
    def step_tuples(
        first: int, scale: wp.float64, box: wp.array(dtype=Box), t: Tuples, b: Bodies,
        share: wp.array(dtype=shares), step_out: wp.array(dtype=positions), dt: real,
        inverse_dt: real,
    ):  # fmt: skip
        r = first + wp.tid()
        if scale >= wp.float64(0.0):
            t.lam[r] = real(0.0)
            if r == 0:
                t.scale[0] = scale
        step_out[r] = positions()
        if wp.static(breakable):
            if t.broken[r] != 0:
                return
        x, e, c, v, w = load(t.particle[r], b)
        n = share[r]
        B = Box()
        if wp.static(wraps):
            B = box[t.world[r]]
        C, G, H, extent = evaluate(x, e, c, v, t.item[r], B, dt)
        split = w
        for a in range(wp.static(size)):
            split[a] = w[a] * n[a]
        lam, good, dx = multiply(
            C, G, H, extent, split, t.lam[r], t.item[r], b.unit, b.most, inverse_dt
        )
        if good:
            t.lam[r] = lam
            for a in range(wp.static(size)):
                dx[a] = dx[a] / n[a]
            step_out[r] = dx

    return step_tuples


@functools.cache
def gather_kernel(law: Solved) -> wp.Kernel:
    """Kernel: every particle goes by the sum of the steps of its tuples."""
    real, Bodies, vec3 = law.precision.scalar, law.types[3], law.precision.vec3
    positions = positions_type(law.precision, law.size)
    kept = rounding_function(law.precision, law.compensated)
    place = place_function(law.precision, law.compensated)

    @register
    def gather_steps(first: int, seats: Seats, step: wp.array(dtype=positions), b: Bodies):
        k = first + wp.tid()
        i = seats.particle[k]
        dx = vec3()
        for n in range(seats.begin[k], seats.begin[k + 1]):
            G = step[seats.tuple[n]]
            dx = dx + G[seats.seat[n]]
        if wp.length_sq(dx) > real(0.0):
            place(i, b.x[i], kept(i, b), dx, b)

    return gather_steps
