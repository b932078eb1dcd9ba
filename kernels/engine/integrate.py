"""Integration: kicks and drifts, with compensated sums where asked for."""

import functools
from types import SimpleNamespace
from typing import Any

import warp as wp

from ..precision import Precision, function, register, structure
from .loops import Periodicity, box_type


def motion_type(precision: Precision) -> Any:
    """The arrays that integration touches; those that a scene does not require stay empty."""
    vec3, real = precision.vec3, precision.scalar
    fields = {
        "x": wp.array(dtype=vec3),
        "v": wp.array(dtype=vec3),
        "w": wp.array(dtype=real),
        "f": wp.array(dtype=vec3),
        "v_half": wp.array(dtype=vec3),
        "v_half_error": wp.array(dtype=vec3),
        "x_error": wp.array(dtype=vec3),
        "v_error": wp.array(dtype=vec3),
        "x_previous": wp.array(dtype=vec3),
        "correction": wp.array(dtype=vec3),
        "image": wp.array(dtype=wp.vec3i),
        "world": wp.array(dtype=wp.int32),
        "box": wp.array(dtype=box_type(precision)),
    }
    return structure(f"Motion_{precision.name}", fields)


def compensated_sum(precision: Precision) -> wp.Function:
    """``add(x, dx, e) -> (sum, error)``: what the sum rounds away goes with the next one's dx.

    Kahan (1965).
    """
    vec3 = precision.vec3

    def kahan(x: vec3, dx: vec3, e: vec3):
        step = dx + e
        total = x + step
        return total, step - (total - x)

    return function(kahan)


def motion_functions(
    precision: Precision, forces: bool, compensated: bool
) -> tuple[wp.Function, wp.Function]:
    """``kick(i, dt, m) -> v``: v += w f dt; and ``move(i, dx, m)``: x += dx."""
    vec3, real, Motion = precision.vec3, precision.scalar, motion_type(precision)
    add = compensated_sum(precision)

    def kick(i: int, dt: real, m: Motion):
        v = m.v[i]
        if wp.static(forces):
            dv = m.f[i] * (m.w[i] * dt)
            if wp.static(compensated):
                v, error = add(v, dv, m.v_error[i])
                m.v_error[i] = error
            else:
                v = v + dv
            m.v[i] = v
        return v

    def move_by(i: int, dx: vec3, m: Motion):
        x = m.x[i]
        if wp.static(compensated):
            x, error = add(x, dx, m.x_error[i])
            m.x_error[i] = error
        else:
            x = x + dx
        m.x[i] = x

    return function(kick), function(move_by)


def wrap_function(
    move: wp.Function, precision: Precision, compensated: bool, remember: bool
) -> wp.Function:
    """``wrap(i, m)``: a particle that has left the periodic box comes in on the other side.

    After that lower <= x < lower + L, also where sums round.
    """
    vec3, real, Motion = precision.vec3, precision.scalar, motion_type(precision)

    def wrap(i: int, m: Motion):
        b = m.box[m.world[i]]
        x = m.x[i]
        shift = vec3()
        crossed = wp.vec3i(0, 0, 0)
        for a in range(3):
            if b.length[a] > real(0.0):
                n = int(wp.floor((x[a] - b.lower[a]) * b.inverse[a]))
                if n == 0 and x[a] >= b.lower[a] + b.length[a]:  # the product was rounded
                    n = 1
                elif n == 0 and x[a] < b.lower[a]:
                    n = -1
                crossed[a] = n
                shift[a] = -real(n) * b.length[a]
        if crossed[0] != 0 or crossed[1] != 0 or crossed[2] != 0:
            if wp.static(compensated):
                error = m.x_error[i]
            move(i, shift, m)
            y = vec3(m.x[i])
            # What was rounded to the upper corner, or below the lower, comes to the lower.
            for a in range(3):
                high = y[a] >= b.lower[a] + b.length[a]
                if b.length[a] > real(0.0) and (high or y[a] < b.lower[a]):
                    if high:
                        crossed[a] += 1
                        shift[a] = -real(crossed[a]) * b.length[a]
                    y[a] = b.lower[a]
                    if wp.static(compensated):
                        rest = (x[a] + shift[a]) - b.lower[a]
                        m.x_error[i][a] = error[a] + rest
            m.x[i] = y
            m.image[i] = m.image[i] + crossed
            if wp.static(remember):
                m.x_previous[i] = m.x_previous[i] + shift

    return function(wrap)


@functools.cache
def integration_kernels(
    precision: Precision, periodic: Periodicity, forces: bool, compensated: bool,
    constrained: bool, remember: bool,
) -> SimpleNamespace:  # fmt: skip
    """The kernels for a scene with forces, Kahan sums, corrections that follow; ``remember``: the
    positions at the start of the substep are kept.
    """
    vec3, real, Motion = precision.vec3, precision.scalar, motion_type(precision)
    kick, move = motion_functions(precision, forces, compensated)
    wrap = wrap_function(move, precision, compensated, remember)
    wraps = bool(periodic)

    @register
    def advance(first: int, dt_kick: real, dt_drift: real, m: Motion):
        """v += w f dt; x += v dt."""
        i = first + wp.tid()
        if wp.static(remember):
            m.x_previous[i] = m.x[i]
        v = kick(i, dt_kick, m)
        move(i, v * dt_drift, m)
        if wp.static(constrained):
            m.correction[i] = vec3()
        if wp.static(wraps):
            wrap(i, m)

    @register
    def kick_only(first: int, dt: real, m: Motion):
        """v += w f dt."""
        kick(first + wp.tid(), dt, m)

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

    @register
    def follow_corrections(first: int, inverse_dt: real, m: Motion):
        """v += correction / dt: the velocity follows the projection."""
        i = first + wp.tid()
        m.v[i] = m.v[i] + m.correction[i] * inverse_dt
        if wp.static(wraps):
            wrap(i, m)

    return SimpleNamespace(
        advance=advance, kick_only=kick_only, foresee=foresee, go_back=go_back,
        follow_corrections=follow_corrections,
    )  # fmt: skip


@functools.cache
def tick_kernel() -> wp.Kernel:
    """Advance the clocks of the worlds."""

    @register
    def tick(first: int, dt: wp.float64, time_io: wp.array(dtype=wp.float64)):
        w = first + wp.tid()
        time_io[w] = time_io[w] + dt

    return tick
