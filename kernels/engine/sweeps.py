"""Sweeps over positions: how far on from one to the next, and whether one more is due."""

import functools

import warp as wp

from ..precision import Precision, register
from .integrate import compensated_sum

DELAY = 2  # sweeps before the first that is accelerated: they smooth what is rough


@functools.cache
def pace_kernel() -> wp.Kernel:
    """Kernel: the number of a sweep, from 1, and its omega (Golub and Van Loan 1996, 10.1.5).

    1 at first, then 2 / (2 - rho^2), then 4 / (4 - rho^2 omega), rho the spectral radius.
    """

    @register
    def pace_sweeps(
        first: int, rho: wp.float64, count_io: wp.array(dtype=wp.int32),
        omega_io: wp.array(dtype=wp.float64),
    ):  # fmt: skip
        k = first + wp.tid()
        count_io[k] = count_io[k] + 1
        n = count_io[k]
        omega = wp.float64(1.0)
        if n == wp.static(DELAY + 1):
            omega = wp.float64(2.0) / (wp.float64(2.0) - rho * rho)
        if n > wp.static(DELAY + 1):
            omega = wp.float64(4.0) / (wp.float64(4.0) - rho * rho * omega_io[k])
        omega_io[k] = omega

    return pace_sweeps


@functools.cache
def go_on_kernel(precision: Precision, compensated: bool) -> wp.Kernel:
    """Kernel: x_k+1 = omega (x' - x_k-1) + x_k-1, x' what a sweep has made of x_k (Wang 2015).

    As corrections since the substep's drift, which are all 0 before its first sweep.
    """
    vec3, real, add = precision.vec3, precision.scalar, compensated_sum(precision.vec3)

    @register
    def go_on_with_positions(
        first: int, count: wp.array(dtype=wp.int32), omega: wp.array(dtype=wp.float64),
        last_io: wp.array(dtype=vec3), before_io: wp.array(dtype=vec3), x: wp.array(dtype=vec3),
        x_error: wp.array(dtype=vec3), correction: wp.array(dtype=vec3),
    ):  # fmt: skip
        i = first + wp.tid()
        last = vec3()
        before = vec3()
        if count[0] > 1:
            last = last_io[i]
            before = before_io[i]
        c = correction[i]
        on = (c - before) * real(omega[0] - wp.float64(1.0))
        if omega[0] > wp.float64(1.0) and wp.length_sq(on) > real(0.0):
            if wp.static(compensated):
                total, error = add(x[i], on, x_error[i])
                x[i] = total
                x_error[i] = error
            else:
                x[i] = x[i] + on
            c = c + on
            correction[i] = c
        before_io[i] = last
        last_io[i] = c

    return go_on_with_positions


@functools.cache
def multipliers_kernel(precision: Precision, one_sided: bool) -> wp.Kernel:
    """Kernel: multipliers go on as positions do; those of inequalities do not pull."""
    real = precision.scalar

    @register
    def go_on_with_multipliers(
        first: int, count: wp.array(dtype=wp.int32), omega: wp.array(dtype=wp.float64),
        last_io: wp.array(dtype=real), before_io: wp.array(dtype=real), lam: wp.array(dtype=real),
    ):  # fmt: skip
        r = first + wp.tid()
        last = real(0.0)
        before = real(0.0)
        if count[0] > 1:
            last = last_io[r]
            before = before_io[r]
        new = lam[r] + (lam[r] - before) * real(omega[0] - wp.float64(1.0))
        if wp.static(one_sided):
            new = wp.max(new, real(0.0))
        lam[r] = new
        before_io[r] = last
        last_io[r] = new

    return go_on_with_multipliers


@functools.cache
def enough_kernel() -> wp.Kernel:
    """Kernel: one more sweep is due where something is not met, but no more than so many."""

    @register
    def count_sweeps(
        first: int, most: int, sweeps_io: wp.array(dtype=wp.int32),
        flag_io: wp.array(dtype=wp.int32),
    ):  # fmt: skip
        k = first + wp.tid()
        sweeps_io[k] = sweeps_io[k] + 1
        if sweeps_io[k] >= most:
            flag_io[k] = 0

    return count_sweeps
