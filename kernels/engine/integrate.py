"""Integration: kicks and drifts, with compensated sums where asked for."""

import functools
from types import SimpleNamespace
from typing import Any

import warp as wp

from ..precision import Precision, function, register, structure
from .loops import Periodicity, box_type


@functools.cache
def motion_type(precision: Precision) -> Any:
    """The arrays that integration touches; those that a scene does not require stay empty."""
    vec3, real = precision.vec3, precision.scalar
    fields = {
        "x": wp.array(dtype=vec3),
        "v": wp.array(dtype=vec3),
        "w": wp.array(dtype=real),
        "f": wp.array(dtype=vec3),
        "x_error": wp.array(dtype=vec3),
        "v_error": wp.array(dtype=vec3),
        "x_previous": wp.array(dtype=vec3),
        "correction": wp.array(dtype=vec3),
        "image": wp.array(dtype=wp.vec3i),
        "world": wp.array(dtype=wp.int32),
        "box": wp.array(dtype=box_type(precision)),
    }
    return structure(f"Motion_{precision.name}", fields)


@functools.cache
def integration_kernels(
    precision: Precision, periodic: Periodicity, forces: bool, compensated: bool,
    constrained: bool, remember: bool,
) -> SimpleNamespace:  # fmt: skip
    """The kernels for what a scene has.

    forces: there are forces. compensated: Kahan sums. constrained: corrections follow.
    remember: keep the positions at the start of the substep.
    """
    vec3, real, Motion = precision.vec3, precision.scalar, motion_type(precision)
    wraps = bool(periodic)

    def kick(i: int, dt: real, m: Motion):
        v = m.v[i]
        if wp.static(forces):
            dv = m.f[i] * (m.w[i] * dt)
            if wp.static(compensated):
                # Kahan (1965): what the sum rounds away is carried to the next one.
                dv = dv + m.v_error[i]
                total = v + dv
                m.v_error[i] = dv - (total - v)
                v = total
            else:
                v = v + dv
            m.v[i] = v
        return v

    def move(i: int, dx: vec3, m: Motion):
        x = m.x[i]
        if wp.static(compensated):
            step = dx + m.x_error[i]
            total = x + step
            m.x_error[i] = step - (total - x)
            m.x[i] = total
        else:
            m.x[i] = x + dx

    add_position = function(move)

    def wrap(i: int, m: Motion):
        # One box length at most: a substep that crosses a whole box is past any stability limit.
        b = m.box[m.world[i]]
        x = m.x[i]
        shift = vec3()
        crossed = wp.vec3i(0, 0, 0)
        for a in range(3):
            if b.length[a] > real(0.0):
                n = int(wp.floor((x[a] - b.lower[a]) * b.inverse[a]))
                crossed[a] = n
                shift[a] = -real(n) * b.length[a]
        if wp.length_sq(shift) > real(0.0):
            add_position(i, shift, m)
            m.image[i] = m.image[i] + crossed
            if wp.static(remember):
                m.x_previous[i] = m.x_previous[i] + shift

    add_force, into_box = function(kick), function(wrap)

    @register
    def advance(first: int, dt_kick: real, dt_drift: real, m: Motion):
        """v += w f dt; x += v dt."""
        i = first + wp.tid()
        if wp.static(remember):
            m.x_previous[i] = m.x[i]
        v = add_force(i, dt_kick, m)
        add_position(i, v * dt_drift, m)
        if wp.static(constrained):
            m.correction[i] = vec3()
        if wp.static(wraps):
            into_box(i, m)

    @register
    def kick_only(first: int, dt: real, m: Motion):
        """v += w f dt."""
        add_force(first + wp.tid(), dt, m)

    @register
    def follow_corrections(first: int, inverse_dt: real, m: Motion):
        """v += correction / dt: the velocity follows the projection."""
        i = first + wp.tid()
        m.v[i] = m.v[i] + m.correction[i] * inverse_dt
        if wp.static(wraps):
            into_box(i, m)

    return SimpleNamespace(
        advance=advance, kick_only=kick_only, follow_corrections=follow_corrections
    )


@functools.cache
def tick_kernel() -> wp.Kernel:
    """Advance the clocks of the worlds."""

    @register
    def tick(first: int, dt: wp.float64, time_io: wp.array(dtype=wp.float64)):
        w = first + wp.tid()
        time_io[w] = time_io[w] + dt

    return tick
