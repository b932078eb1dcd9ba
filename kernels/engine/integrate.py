"""Integration: what kicks and drifts do to a particle, with compensated sums where asked for."""

import functools
from types import SimpleNamespace
from typing import Any

import warp as wp

from ..precision import Precision, function, structure
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


def widened(precision: Precision) -> wp.Function:
    """``wide(v)``: a vector in float64."""
    vec3 = precision.vec3

    def wide(v: vec3):
        return wp.vec3d(wp.float64(v[0]), wp.float64(v[1]), wp.float64(v[2]))

    return function(wide)


def compensated_sum(kind: Any) -> wp.Function:
    """``add(x, dx, e) -> (sum, error)``, of vectors or numbers: what the sum rounds away goes with
    the next one's dx (Kahan 1965).
    """

    def kahan(x: kind, dx: kind, e: kind):
        step = dx + e
        total = x + step
        return total, step - (total - x)

    return function(kahan)


def motion_functions(
    precision: Precision, forces: bool, compensated: bool
) -> tuple[wp.Function, wp.Function]:
    """``kick(i, dt, m) -> v``: v += w f dt; and ``move(i, dx, m)``: x += dx."""
    vec3, real, Motion = precision.vec3, precision.scalar, motion_type(precision)
    add = compensated_sum(precision.vec3)

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
def plain_rows(
    precision: Precision, periodic: Periodicity, forces: bool, compensated: bool,
    constrained: bool, remember: bool,
) -> SimpleNamespace:  # fmt: skip
    """What is done to rows from ``first`` to ``last``, in Warp's own language.

    - ``advance(first, last, dt_kick, dt_drift, m)``: v += w f dt; x += v dt;
    - ``kick(first, last, dt, m)``: v += w f dt;
    - ``follow(first, last, inverse_dt, m)``: v += correction / dt, the velocity follows.
    """
    vec3, real, Motion = precision.vec3, precision.scalar, motion_type(precision)
    kick, move = motion_functions(precision, forces, compensated)
    wrap = wrap_function(move, precision, compensated, remember)
    wraps = bool(periodic)

    def advance_plainly(first: int, last: int, dt_kick: real, dt_drift: real, m: Motion):
        for i in range(first, last):
            if wp.static(remember):
                m.x_previous[i] = m.x[i]
            v = kick(i, dt_kick, m)
            move(i, v * dt_drift, m)
            if wp.static(constrained):
                m.correction[i] = vec3()
            if wp.static(wraps):
                wrap(i, m)

    def kick_plainly(first: int, last: int, dt: real, m: Motion):
        for i in range(first, last):
            kick(i, dt, m)

    def follow_plainly(first: int, last: int, inverse_dt: real, m: Motion):
        for i in range(first, last):
            m.v[i] = m.v[i] + m.correction[i] * inverse_dt
            if wp.static(wraps):
                wrap(i, m)

    return SimpleNamespace(
        advance=function(advance_plainly), kick=function(kick_plainly),
        follow=function(follow_plainly),
    )  # fmt: skip
