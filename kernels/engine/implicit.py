"""Forces that are implicit in the velocity: how far ahead it is, and what they are there."""

import functools
from types import SimpleNamespace

import warp as wp

from ..precision import Precision, function, register
from .integrate import motion_type, widened


def _narrowed(precision: Precision) -> wp.Function:
    """``narrow(u)``: a vector in float64, in the precision."""
    vec3, real = precision.vec3, precision.scalar

    def narrow(u: wp.vec3d):
        return vec3(real(u[0]), real(u[1]), real(u[2]))

    return function(narrow)


def _turns(precision: Precision) -> wp.Function:
    """``turns(J)``: whether it has an antisymmetric part."""
    mat33 = precision.mat33

    def turns(J: mat33):
        return J[0, 1] != J[1, 0] or J[0, 2] != J[2, 0] or J[1, 2] != J[2, 1]

    return function(turns)


def ahead_function(precision: Precision, damps: bool, predicted: bool) -> wp.Function:
    """``ahead(i, dt, f, J, m) -> u``: v + u = v + w f(v + u) dt to first order.

    u = (1 - w J dt)^-1 w f dt, in double precision, as a determinant is a product of three.

    Args:
        precision: Of the arrays.
        damps: J = df/dv as it is, f are all forces. Else J's antisymmetric part, which turns the
            velocity, f the implicit forces alone.
        predicted: v has been foreseen, and v_half is what the forces start from.
    """
    vec3, real, mat33, Motion = (
        precision.vec3, precision.scalar, precision.mat33, motion_type(precision)
    )  # fmt: skip
    wide, narrow, turns = widened(precision), _narrowed(precision), _turns(precision)

    def ahead(i: int, dt: wp.float64, f: vec3, J: mat33, m: Motion):
        a = wp.float64(m.w[i]) * dt
        dv = wide(f) * a
        if wp.static(predicted):
            dv = dv - wide(m.v[i] - m.v_half[i])
        A = wp.identity(n=3, dtype=wp.float64)
        if wp.static(damps):
            for r in range(3):
                for c in range(3):
                    A[r, c] -= a * wp.float64(J[r, c])
            dv = wp.inverse(A) * dv
        elif turns(J):
            for r in range(3):
                for c in range(3):
                    A[r, c] -= a * wp.float64((J[r, c] - J[c, r]) * real(0.5))
            dv = wp.inverse(A) * dv
        return narrow(dv)

    return function(ahead)


def arrive_function(precision: Precision, damps: bool, predicted: bool) -> wp.Function:
    """``arrive(i, dt, u, others, J, m)``: f = u / (w dt), and what others add.

    Not f + J u, of which nothing may be left but rounding. See :func:`ahead_function`.
    """
    vec3, mat33, Motion = precision.vec3, precision.mat33, motion_type(precision)
    wide, narrow, turns = widened(precision), _narrowed(precision), _turns(precision)

    def arrive(i: int, dt: wp.float64, u: vec3, others: vec3, J: mat33, m: Motion):
        a = wp.float64(m.w[i]) * dt
        if a > wp.float64(0.0):
            if wp.static(predicted):
                u = u + (m.v[i] - m.v_half[i])
            if wp.static(damps):
                m.f[i] = narrow(wide(u) / a)
            elif turns(J):
                m.f[i] = others + narrow(wide(u) / a)

    return function(arrive)


@functools.cache
def implicit_kernels(precision: Precision, damps: bool, predicted: bool) -> SimpleNamespace:
    """Kernels: ``lead`` keeps how far the velocity is ahead, ``settle`` makes the sum of all forces
    what takes it there, ``respond`` is both, where nobody asks in between.

    Unless it ``damps``, ``own`` are the implicit forces; ``lead`` leaves all others there.
    """
    vec3, mat33, Motion = precision.vec3, precision.mat33, motion_type(precision)
    ahead = ahead_function(precision, damps, predicted)
    arrive = arrive_function(precision, damps, predicted)

    @register
    def lead(
        first: int,
        dt: wp.float64,
        m: Motion,
        slope: wp.array(dtype=mat33),
        own_io: wp.array(dtype=vec3),
        lead_out: wp.array(dtype=vec3),
    ):
        i = first + wp.tid()
        f = m.f[i]
        if wp.static(not damps):
            f = own_io[i]
            own_io[i] = m.f[i] - f
        lead_out[i] = ahead(i, dt, f, slope[i], m)

    @register
    def settle(
        first: int,
        dt: wp.float64,
        m: Motion,
        slope: wp.array(dtype=mat33),
        others: wp.array(dtype=vec3),
        lead: wp.array(dtype=vec3),
    ):
        i = first + wp.tid()
        rest = vec3()
        if wp.static(not damps):
            rest = others[i]
        arrive(i, dt, lead[i], rest, slope[i], m)

    @register
    def respond(
        first: int,
        dt: wp.float64,
        m: Motion,
        slope: wp.array(dtype=mat33),
        own: wp.array(dtype=vec3),
    ):
        i = first + wp.tid()
        f = m.f[i]
        rest = vec3()
        if wp.static(not damps):
            f = own[i]
            rest = m.f[i] - f
        arrive(i, dt, ahead(i, dt, f, slope[i], m), rest, slope[i], m)

    return SimpleNamespace(lead=lead, settle=settle, respond=respond)
