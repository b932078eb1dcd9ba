"""Pressures of an incompressible fluid: corrections, world by world, until they fit.

What is sought are k >= 0 with r = s - A k <= 0, and r = 0 where k > 0: no pressure pulls, and where
there is one nothing is compressed and nothing parts. A projected gradient does it,

    k <- max(0, k + omega r / A_ii)

whose omega is that of Barzilai and Borwein (1988), of one kind and the other in turn (Dai and
Fletcher 2005), from sums over each world. How far off k is, is told by what a whole step would
change: r where it is above 0, else the smaller of -r and A_ii k.
"""

import functools
from typing import Any

import warp as wp

from ....engine.loops import Pairs
from ....precision import Precision, register

BLOCK = 128  # slots that one thread sums
LEAST, MOST = 0.05, 20.0  # of omega
LEAST_ITERATIONS = 2  # pressures then follow what changes slowly below the tolerance, too


@functools.cache
def begin_kernel(precision: Precision, fluid: Any) -> wp.Kernel:
    """Kernel: what is sought, and that it is sought from the pressures of the substep before."""
    real, pair2, vec4 = precision.scalar, precision.vector(2), precision.vector(4)

    @register
    def begin_pressure(
        first: int,
        pairs: Pairs,
        fluids: wp.array(dtype=fluid),
        rate: wp.array(dtype=real),
        warm: wp.array(dtype=real),
        dt: real,
        push: real,
        state: wp.array(dtype=vec4),
        k_out: wp.array(dtype=real),
        source_out: wp.array(dtype=real),
        before_out: wp.array(dtype=pair2),
        running_out: wp.array(dtype=wp.int32),
        iterations_out: wp.array(dtype=wp.int32),
        flag_out: wp.array(dtype=wp.int32),
    ):
        """s = gap / dt^2 + drho/dt / dt, of what is beyond the rest density the part ``push``."""
        i = first + wp.tid()
        w = pairs.world[i]
        gap = state[i][1] - fluids[w].rest_density
        gap = wp.where(gap > real(0.0), push * gap, gap)
        source_out[i] = (gap / dt + rate[i]) / dt
        k = warm[pairs.order[i]]
        k_out[i] = k
        before_out[i] = pair2(k, real(0.0))
        running_out[w] = 1
        iterations_out[w] = 0
        flag_out[0] = 1

    return begin_pressure


@functools.cache
def residual_kernel(precision: Precision) -> wp.Kernel:
    """Kernel: how far pressures are off, by block."""
    real, pair2 = precision.scalar, precision.vector(2)

    @register
    def sum_residuals(
        first: int,
        begin: wp.array(dtype=wp.int32),
        end: wp.array(dtype=wp.int32),
        m: wp.array(dtype=real),
        pressures: wp.array(dtype=real),
        source: wp.array(dtype=real),
        rate: wp.array(dtype=real),
        diagonal: wp.array(dtype=real),
        before: wp.array(dtype=pair2),
        residual_out: wp.array(dtype=real),
        sums_out: wp.array(dtype=wp.vec4d),
        flag_out: wp.array(dtype=wp.int32),
    ):
        """Of a block: how far k is off, and the products of its last change and that of r."""
        block = first + wp.tid()
        flag_out[0] = 0
        sums = wp.vec4d()
        for i in range(begin[block], end[block]):
            k = pressures[i]
            A = diagonal[i]
            r = source[i] + rate[i]
            residual_out[i] = r
            off = wp.where(r > real(0.0), r, wp.min(-r, A * k))
            dk = wp.float64(k - before[i][0])
            dr = wp.float64(before[i][1] - r)
            mass = wp.float64(m[i])
            sums[0] = sums[0] + wp.float64(off)
            sums[1] = sums[1] + mass * wp.float64(A) * dk * dk
            sums[2] = sums[2] + mass * dk * dr
            if A > real(0.0):
                sums[3] = sums[3] + mass * dr * dr / wp.float64(A)
        sums_out[block] = sums

    return sum_residuals


@functools.cache
def decide_kernel(fluid: Any) -> wp.Kernel:
    """Kernel: whether worlds go on, and by which step."""

    @register
    def decide(
        first: int,
        edge: wp.array(dtype=wp.int32),
        begin: wp.array(dtype=wp.int32),
        end: wp.array(dtype=wp.int32),
        fluids: wp.array(dtype=fluid),
        sums: wp.array(dtype=wp.vec4d),
        dt: wp.float64,
        tolerance: wp.float64,
        most: int,
        first_omega: wp.array(dtype=wp.float64),
        omega_out: wp.array(dtype=wp.float64),
        error_out: wp.array(dtype=wp.float64),
        running_io: wp.array(dtype=wp.int32),
        iterations_io: wp.array(dtype=wp.int32),
        flag_out: wp.array(dtype=wp.int32),
    ):
        """Of a world: whether it goes on, and by which step."""
        w = first + wp.tid()
        if running_io[w] != 0:
            total = wp.vec4d()
            for block in range(edge[w], edge[w + 1]):
                total += sums[block]
            count = end[edge[w + 1] - 1] - begin[edge[w]]
            part = dt * dt / (wp.float64(fluids[w].rest_density) * wp.float64(count))
            error = total[0] * part
            error_out[w] = error
            n = iterations_io[w]
            if (error <= tolerance and n >= LEAST_ITERATIONS) or n >= most:
                running_io[w] = 0
            else:
                omega = first_omega[w]
                if n > 0 and total[2] > wp.float64(0.0):
                    omega = total[1] / total[2]
                    if n % 2 == 0 and total[3] > wp.float64(0.0):
                        omega = total[2] / total[3]
                    omega = wp.clamp(omega, wp.float64(LEAST), wp.float64(MOST))
                omega_out[w] = omega
                iterations_io[w] = n + 1
                flag_out[0] = 1

    return decide


@functools.cache
def correct_kernel(precision: Precision) -> wp.Kernel:
    """Kernel: pressures come to where they fit."""
    real, pair2 = precision.scalar, precision.vector(2)

    @register
    def correct(
        first: int,
        pairs: Pairs,
        running: wp.array(dtype=wp.int32),
        omega: wp.array(dtype=wp.float64),
        residual: wp.array(dtype=real),
        diagonal: wp.array(dtype=real),
        k_io: wp.array(dtype=real),
        before_out: wp.array(dtype=pair2),
    ):
        """k <- max(0, k + omega r / A_ii) in worlds that go on."""
        i = first + wp.tid()
        w = pairs.world[i]
        if running[w] != 0:
            k = k_io[i]
            before_out[i] = pair2(k, residual[i])
            if diagonal[i] > real(0.0):
                k = wp.max(k + real(omega[w]) * residual[i] / diagonal[i], real(0.0))
            k_io[i] = k

    return correct
