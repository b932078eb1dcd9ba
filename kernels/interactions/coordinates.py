"""What the law of a tuple is of: a length, an angle or a dihedral, and how it answers to motion.

A coordinate is a Warp function ``(E) -> (q, T)``. Row e of E is the step from particle e of the
tuple to the next, x_(e+1) - x_e; row e of T is dq/dE_e. Particle a then has the gradient
T_(a-1) - T_a, so that the gradients of a tuple sum to zero whatever is rounded.
Vectors are made of unit length before they are multiplied, which keeps products of lengths within
single precision.
"""

from typing import Any

import numpy as np
import warp as wp

from ..precision import APART, Precision, function

# Sine of the angle between neighbouring bonds below which the force of a dihedral fades to nothing.
LINE = 1e-3


def steps_type(precision: Precision, size: int) -> Any:
    """One row for each step along a tuple of ``size`` particles."""
    return wp.types.matrix(shape=(size - 1, 3), dtype=precision.scalar)


def length(precision: Precision) -> wp.Function:
    """r = |E_0|. Coincident ends push apart along a fixed direction, equally and opposite."""
    real, Steps, along = precision.scalar, steps_type(precision, 2), precision.vec3(*APART)

    def bond_length(E: Steps):
        d = E[0]
        r = wp.length(d)
        apart = r > real(0.0)
        T = Steps()
        T[0] = wp.where(apart, d / wp.where(apart, r, real(1.0)), along)
        return r, T

    return function(bond_length)


def length_squared(precision: Precision) -> wp.Function:
    """r^2."""
    real, Steps = precision.scalar, steps_type(precision, 2)

    def bond_length_squared(E: Steps):
        d = E[0]
        T = Steps()
        T[0] = d * real(2.0)
        return wp.dot(d, d), T

    return function(bond_length_squared)


def _direction(precision: Precision) -> wp.Function:
    """``direction(d) -> (n, inverse)``: d / |d| and 1 / |d|, both zero where d is."""
    vec3, real = precision.vec3, precision.scalar

    def direction(d: vec3):
        r = wp.length(d)
        apart = r > real(0.0)
        inverse = wp.where(apart, real(1.0) / wp.where(apart, r, real(1.0)), real(0.0))
        return d * inverse, inverse

    return function(direction)


def angle(precision: Precision) -> wp.Function:
    """The angle at the middle, 0 to pi, by its sine and cosine: to all digits at either end.

    With u and w from the middle to the ends and n along u x w, it grows by turning w about n and u
    against it. Where all three are on a line n is any direction across, always the same.
    """
    real, Steps, direction = precision.scalar, steps_type(precision, 3), _direction(precision)
    x_axis, y_axis = precision.vec3(1.0, 0.0, 0.0), precision.vec3(0.0, 1.0, 0.0)

    def bond_angle(E: Steps):
        u, u_inverse = direction(-E[0])
        w, w_inverse = direction(E[1])
        c = wp.cross(u, w)
        s = wp.length(c)
        across = wp.normalize(wp.cross(u, wp.where(wp.abs(u[0]) < real(0.9), x_axis, y_axis)))
        bent = s > real(0.0)
        n = wp.where(bent, c / wp.where(bent, s, real(1.0)), across)
        T = Steps()
        T[0] = wp.cross(n, u) * u_inverse
        T[1] = wp.cross(n, w) * w_inverse
        return wp.atan2(s, wp.dot(u, w)), T

    return function(bond_angle)


def cosine(precision: Precision) -> wp.Function:
    """The cosine of that angle, whose gradient vanishes on a line."""
    Steps, direction = steps_type(precision, 3), _direction(precision)

    def bond_cosine(E: Steps):
        u, u_inverse = direction(-E[0])
        w, w_inverse = direction(E[1])
        c = wp.dot(u, w)
        T = Steps()
        T[0] = (u * c - w) * u_inverse
        T[1] = (u - w * c) * w_inverse
        return c, T

    return function(bond_cosine)


def dihedral(precision: Precision) -> wp.Function:
    """The dihedral, -pi to pi, 0 for cis, positive if clockwise along the middle bond (IUPAC).

    Its gradient by the normals of both planes (Blondel and Karplus 1996, eq. 27, by steps), which
    divides by the sine of no dihedral. Where three particles are on a line it does not exist, and
    near it goes to infinity: all of it is scaled by sin^2 / LINE^2 there, which turns nothing.
    """
    real, Steps, direction = precision.scalar, steps_type(precision, 4), _direction(precision)
    line = precision.scalar(1.0 / LINE**2)
    tiny = precision.scalar(np.finfo(precision.numpy).tiny)  # a square below it is nothing

    def bond_dihedral(E: Steps):
        a, a_inverse = direction(E[0])
        b, b_inverse = direction(E[1])
        c, c_inverse = direction(E[2])
        m = wp.cross(a, b)
        n = wp.cross(b, c)
        m2 = wp.dot(m, m)
        n2 = wp.dot(n, n)
        scale = wp.min(real(1.0), wp.min(m2, n2) * line)
        over_m = m * (scale / wp.max(m2, tiny))
        over_n = n * (scale / wp.max(n2, tiny))
        T = Steps()
        T[0] = over_m * a_inverse
        T[1] = -(over_m * wp.dot(a, b) + over_n * wp.dot(c, b)) * b_inverse
        T[2] = over_n * c_inverse
        return wp.atan2(wp.dot(a, n), wp.dot(m, n)), T

    return function(bond_dihedral)
