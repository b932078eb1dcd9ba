"""The kernels that move particles."""

import functools
from types import SimpleNamespace

import warp as wp

from ..precision import Precision, register
from .integrate import motion_functions, motion_type, plain_rows, wrap_function
from .loops import Periodicity
from .native_motion import BLOCK, native_rows


@functools.cache
def integration_kernels(
    precision: Precision, periodic: Periodicity, forces: bool, compensated: bool,
    constrained: bool, remember: bool, vectorised: bool,
) -> SimpleNamespace:  # fmt: skip
    """The kernels for a scene with forces, Kahan sums, corrections that follow; ``remember``: the
    positions at the start of the substep are kept. A thread takes ``block`` rows.
    """
    real, Motion = precision.scalar, motion_type(precision)
    make, block = (native_rows, BLOCK) if vectorised else (plain_rows, 1)
    rows = make(precision, periodic, forces, compensated, constrained, remember)
    advance_rows, kick_rows, follow_rows = rows.advance, rows.kick, rows.follow
    kick, _ = motion_functions(precision, forces, compensated)
    moving = functools.partial(register, cpu_only=vectorised)

    @moving
    def advance(first: int, dt_kick: real, dt_drift: real, m: Motion):
        """v += w f dt; x += v dt."""
        i = (first + wp.tid()) * wp.static(block)
        advance_rows(i, wp.min(i + wp.static(block), m.x.shape[0]), dt_kick, dt_drift, m)

    @moving
    def kick_only(first: int, dt: real, m: Motion):
        """v += w f dt."""
        i = (first + wp.tid()) * wp.static(block)
        kick_rows(i, wp.min(i + wp.static(block), m.x.shape[0]), dt, m)

    @moving
    def follow_corrections(first: int, inverse_dt: real, m: Motion):
        """v += correction / dt: the velocity follows the projection."""
        i = (first + wp.tid()) * wp.static(block)
        follow_rows(i, wp.min(i + wp.static(block), m.x.shape[0]), inverse_dt, m)

    @register
    def foresee(first: int, dt: real, m: Motion):
        """v += w f dt, as the forces will leave it if they stay; what it was is kept."""
        i = first + wp.tid()
        m.v_half[i] = m.v[i]
        if wp.static(compensated):
            m.v_half_error[i] = m.v_error[i]
        kick(i, dt, m)

    @register
    def go_back(first: int, m: Motion):
        """v is again what it was."""
        i = first + wp.tid()
        m.v[i] = m.v_half[i]
        if wp.static(compensated):
            m.v_error[i] = m.v_half_error[i]

    return SimpleNamespace(
        advance=advance, kick_only=kick_only, foresee=foresee, go_back=go_back,
        follow_corrections=follow_corrections, block=block,
    )  # fmt: skip


@functools.cache
def go_on_kernel(
    precision: Precision, periodic: Periodicity, compensated: bool, remember: bool
) -> wp.Kernel:
    """Kernel: x += v dt, the second part of a drift that something was done in the middle of."""
    real, Motion = precision.scalar, motion_type(precision)
    _, move = motion_functions(precision, False, compensated)
    wrap = wrap_function(move, precision, compensated, remember)
    wraps = bool(periodic)

    @register
    def go_on(first: int, dt: real, m: Motion):
        i = first + wp.tid()
        move(i, m.v[i] * dt, m)
        if wp.static(wraps):
            wrap(i, m)

    return go_on


@functools.cache
def tick_kernel() -> wp.Kernel:
    """Advance the clocks of the worlds."""

    @register
    def tick(first: int, dt: wp.float64, time_io: wp.array(dtype=wp.float64)):
        w = first + wp.tid()
        time_io[w] = time_io[w] + dt

    return tick
