"""Forces that are implicit in the velocity: how far ahead it is, and what they are there."""

import functools

import warp as wp

from ..precision import Precision, function, register
from .copy import widened
from .integrate import motion_type


def _narrowed(precision: Precision) -> wp.Function:
    """``narrow(u)``: a vector in float64, in the precision."""
    vec3, real = precision.vec3, precision.scalar

    def narrow(u: wp.vec3d):
        return vec3(real(u[0]), real(u[1]), real(u[2]))

    return function(narrow)


@functools.cache
def lead_kernel(precision: Precision, damps: bool, predicted: bool) -> wp.Kernel:
    """Kernel: u = (1 - w J dt)^-1 w f dt, by which v + u = v + w f(v + u) dt to first order.

    In double precision, as a determinant is a product of three.

    Args:
        precision: Of the arrays.
        damps: J = df/dv, f are all forces. Else J is its antisymmetric part, which turns the
            velocity, f the implicit forces alone; all others are then left in their array.
        predicted: v has been foreseen, and v_half is what the forces start from.
    """
    vec3, real, mat33, Motion = (
        precision.vec3, precision.scalar, precision.mat33, motion_type(precision)
    )  # fmt: skip
    wide, narrow = widened(precision), _narrowed(precision)

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
        a = wp.float64(m.w[i]) * dt
        J = slope[i]
        if wp.static(damps):
            dv = wide(m.f[i]) * a
        else:
            J = (J - wp.transpose(J)) * real(0.5)
            dv = wide(own_io[i]) * a
            own_io[i] = m.f[i] - own_io[i]
        if wp.static(predicted):
            dv = dv - wide(m.v[i] - m.v_half[i])
        A = wp.identity(n=3, dtype=wp.float64)
        for r in range(3):
            for c in range(3):
                A[r, c] -= a * wp.float64(J[r, c])
        lead_out[i] = narrow(wp.inverse(A) * dv)

    return lead


@functools.cache
def settle_kernel(precision: Precision, damps: bool, predicted: bool) -> wp.Kernel:
    """Kernel: f = u / (w dt), and what others add: not f + J u, of which nothing may be left but
    rounding. See :func:`lead_kernel`.
    """
    vec3, mat33, Motion = precision.vec3, precision.mat33, motion_type(precision)
    wide, narrow = widened(precision), _narrowed(precision)

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
        a = wp.float64(m.w[i]) * dt
        if a > wp.float64(0.0):
            u = lead[i]
            if wp.static(predicted):
                u = u + (m.v[i] - m.v_half[i])
            if wp.static(damps):
                m.f[i] = narrow(wide(u) / a)
            else:
                J = slope[i]
                if J[0, 1] != J[1, 0] or J[0, 2] != J[2, 0] or J[1, 2] != J[2, 1]:
                    m.f[i] = others[i] + narrow(wide(u) / a)

    return settle
