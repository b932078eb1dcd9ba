"""Elastic solids: deformations from what is left of the links at rest, then forces along them.

Links are those of the undeformed solid, with X = X_j - X_i and the weight c = V_i V_j s of both.
With u = x_j - x_i - X, which is zero at rest to the last bit,

    D_i = (sum_j c u X^T) M_i^-1,   M_i = sum_j c X X^T      (the displacement gradient, F = 1 + D)
    B_i = V_i P_i M_i^-1 - k D_i                             (P: Piola and Kirchhoff's first stress)
    f_i = sum_j c ((B_i + B_j) X + 2 k u)

Seen from j both X and u have the other sign, and all else is the same: forces of a link are
opposite to the last bit.
"""

import functools
from typing import Any

import warp as wp

from ..engine.loops import Periodicity, box_type, minimum_image
from ..precision import Precision, function, register, structure
from ..tensor import virial_function, virial_type


def solid_type(precision: Precision) -> Any:
    """A solid's particles, row k those of ``particle[k]``, and its links by the first of them."""
    whole, real = wp.array(dtype=wp.int32), wp.array(dtype=precision.scalar)
    matrix = wp.array(dtype=precision.mat33)
    fields = {
        "particle": whole, "world": whole, "begin": whole,
        "other": whole,  # row of a link's second particle
        "link": wp.array(dtype=precision.vector(4)),  # X and c
        "V": real,
        "inverse": matrix,  # M^-1
        "D": matrix, "B": matrix,
    }  # fmt: skip
    return structure(f"Solid_{precision.name}", fields)


@functools.cache
def _along(precision: Precision, periodic: Periodicity) -> wp.Function:
    """``along(n, i, x, b, d) -> (X, c, u)`` of link n of particle i."""
    vec3, Solid, Box = precision.vec3, solid_type(precision), box_type(precision)
    real, image = precision.scalar, minimum_image(precision, periodic)

    def along(n: int, x_i: vec3, x: wp.array(dtype=vec3), b: Box, s: Solid):
        link = s.link[n]
        X = vec3(link[0], link[1], link[2])
        u = image(x[s.particle[s.other[n]]] - x_i, b) - X
        return X, real(link[3]), u

    return function(along)


@functools.cache
def deform_kernel(
    precision: Precision, periodic: Periodicity, damped: bool, params: Any
) -> wp.Kernel:
    """Kernel: D and B of every particle.

    S = lambda tr(E) 1 + 2 mu E, with E + tau dE/dt in place of E where it is damped. Where det F
    is not above 0, no stress goes with the strain: it is no number.
    """
    vec3, mat33, real = precision.vec3, precision.mat33, precision.scalar
    Solid, Box, along = solid_type(precision), box_type(precision), _along(precision, periodic)

    @register
    def solid_deform(
        first: int,
        parameters: wp.array(dtype=params),
        box: wp.array(dtype=Box),
        s: Solid,
        x: wp.array(dtype=vec3),
        v: wp.array(dtype=vec3),
    ):
        k = first + wp.tid()
        i = s.particle[k]
        b = box[s.world[k]]
        p = parameters[s.world[k]]
        x_i = x[i]
        one = wp.identity(n=3, dtype=real)
        D = mat33()
        rate = mat33()
        for n in range(s.begin[k], s.begin[k + 1]):
            X, c, u = along(n, x_i, x, b, s)
            D += wp.outer(u, c * X)
            if wp.static(damped):
                rate += wp.outer(v[s.particle[s.other[n]]] - v[i], c * X)
        D = D * s.inverse[k]
        F = one + D
        E = real(0.5) * (D + wp.transpose(D) + wp.transpose(D) * D)
        if wp.static(damped):
            G = wp.transpose(F) * (rate * s.inverse[k])
            E += (real(0.5) * p.dissipation) * (G + wp.transpose(G))
        S = (p.lame * wp.trace(E)) * one + (real(2.0) * p.shear) * E
        B = s.V[k] * (F * S * s.inverse[k]) - p.hourglass * D
        if not wp.determinant(F) > real(0.0):
            B = B * real(wp.nan)
        s.D[k] = D
        s.B[k] = B

    return solid_deform


@functools.cache
def force_kernel(precision: Precision, periodic: Periodicity, params: Any) -> wp.Kernel:
    """Kernel: f += sum_j c ((B_i + B_j) X + 2 k u)."""
    vec3, real = precision.vec3, precision.scalar
    Solid, Box, along = solid_type(precision), box_type(precision), _along(precision, periodic)

    @register
    def solid_force(
        first: int,
        parameters: wp.array(dtype=params),
        box: wp.array(dtype=Box),
        s: Solid,
        x: wp.array(dtype=vec3),
        f_io: wp.array(dtype=vec3),
    ):
        k = first + wp.tid()
        i = s.particle[k]
        b = box[s.world[k]]
        twice = real(2.0) * parameters[s.world[k]].hourglass
        x_i = x[i]
        B_i = s.B[k]
        total = vec3()
        for n in range(s.begin[k], s.begin[k + 1]):
            X, c, u = along(n, x_i, x, b, s)
            total += c * ((B_i + s.B[s.other[n]]) * X + twice * u)
        f_io[i] = f_io[i] + total

    return solid_force


@functools.cache
def measure_kernel(
    precision: Precision, periodic: Periodicity, params: Any, tensor: bool
) -> wp.Kernel:
    """Kernel: V (lambda tr(E)^2 / 2 + mu E:E) + k sum_j c |u - D X|^2 / 2, and the virial.

    Of the virial of a link, x_ij f_ij^T, each particle has a half.
    """
    vec3, real, kind = precision.vec3, precision.scalar, virial_type(tensor)
    Solid, Box, along = solid_type(precision), box_type(precision), _along(precision, periodic)
    virial = virial_function(precision, tensor)

    @register
    def solid_measure(
        first: int,
        parameters: wp.array(dtype=params),
        box: wp.array(dtype=Box),
        s: Solid,
        x: wp.array(dtype=vec3),
        energy_io: wp.array(dtype=wp.float64),
        virial_io: wp.array(dtype=kind),
    ):
        k = first + wp.tid()
        i = s.particle[k]
        b = box[s.world[k]]
        p = parameters[s.world[k]]
        half, x_i, D, B_i = wp.float64(0.5), x[i], s.D[k], s.B[k]
        E = real(0.5) * (D + wp.transpose(D) + wp.transpose(D) * D)
        trace = wp.trace(E)
        stored = real(0.5) * p.lame * trace * trace + p.shear * wp.ddot(E, E)
        energy = wp.float64(s.V[k] * stored)
        for n in range(s.begin[k], s.begin[k + 1]):
            X, c, u = along(n, x_i, x, b, s)
            off = u - D * X
            f = c * ((B_i + s.B[s.other[n]]) * X + (real(2.0) * p.hourglass) * u)
            energy += half * wp.float64(p.hourglass * c * wp.dot(off, off))
            virial_io[i] = virial_io[i] - half * virial(f, X + u)
        energy_io[i] = energy_io[i] + energy

    return solid_measure
