"""Smoothed particle hydrodynamics: terms of pairs, and what is kept of their sums.

Two passes over one neighbour list. The first sums the density and keeps each particle's state in
slot order; the second sums the force from the states of both particles:

    rho_i = sum_j m_j W_ij
    f_i   = -m_i sum_j m_j (P_i/rho_i^2 + P_j/rho_j^2 + Pi_ij) grad_i W_ij

Laws of the fluid reach the terms bound to their parameters (:func:`bound_law`). Everything between
a neighbour's index and its contribution is free of branches, so that the loops vectorise.
"""

import functools
from collections.abc import Mapping
from typing import Any

import warp as wp

from ..engine.loops import Term, reader
from ..precision import Precision, function, function_from_source
from ..warp_internals import arguments as arguments_of

# Where coincident particles are pushed along, within the line or plane of a lower dimension.
DIRECTIONS = {1: (1.0, 0.0, 0.0), 2: (0.6, 0.8, 0.0), 3: (0.48, 0.6, 0.64)}


def bound_law(
    name: str, law: wp.Function, variables: tuple[str, ...], sources: Mapping[str, str],
    precision: Precision, params: Any,
) -> wp.Function:  # fmt: skip
    """``name(*variables, p)`` that calls ``law`` with, for each of its arguments, its source."""
    arguments = ", ".join(sources[argument] for argument in arguments_of(law))
    signature = ", ".join(f"{variable}: real" for variable in variables)
    source = f"def {name}({signature}, p: Params):\n    return law({arguments})\n"
    return function_from_source(source, {"law": law, "real": precision.scalar, "Params": params})


def density_term(weight: wp.Function, precision: Precision, data: Any, params: Any) -> Term:
    """Term m_j w(q), the density without the normalisation of W."""
    real, vec3, one = precision.scalar, precision.vec3, precision.vector(1)
    read = reader(precision)

    def add_density(i: int, j: int, x_ij: vec3, r2: real, d: data, p: params):
        return one(read(d.m, j) * weight(wp.sqrt(r2) * p.inverse_h))

    return Term(function(add_density), 1, rounding="fused")


@functools.cache
def keep_state(
    weight: wp.Function, pressure: wp.Function, sound_speed: wp.Function | None,
    precision: Precision, data: Any, params: Any, out: Any,
) -> wp.Function:  # fmt: skip
    """Store: density and pressure of the particle, and (m, rho, P/rho^2, c) in slot order.

    ``sound_speed`` None leaves c at 0.
    """
    real, one, vec4 = precision.scalar, precision.vector(1), precision.vector(4)
    sounds = sound_speed is not None

    def keep(i: int, particle: int, total: one, d: data, p: params, o: out):
        m = d.m[i]
        rho = p.sigma * (total[0] + m * weight(real(0.0)))  # the sum is over the others
        pressure_i = pressure(rho, p)
        c = real(0.0)
        if wp.static(sounds):
            c = sound_speed(rho, pressure_i, p)
        o.state[i] = vec4(m, rho, pressure_i / (rho * rho), c)
        o.rho[particle] = rho
        o.pressure[particle] = pressure_i

    return function(keep)


def force_term(
    slope: wp.Function, laws: Mapping[str, wp.Function], switched: bool, dimension: int,
    precision: Precision, data: Any, params: Any,
) -> Term:  # fmt: skip
    """Term f_ij / m_i = -m_j (P_i/rho_i^2 + P_j/rho_j^2 + Pi_ij) grad_i W_ij.

    Where there is a law ``drag``, D_ij, with m_j D_ij W_ij' / r v_ij beside it.
    ``switched``: Pi_ij is multiplied by the mean of the particles' switches.

    grad W vanishes with r, so coincident particles are taken as h apart along a fixed direction,
    in the order of their slots: they push each other apart, equally and opposite.
    """
    real, vec3, pair2 = precision.scalar, precision.vec3, precision.vector(2)
    state_of, velocity_of, read = reader(precision, 4), reader(precision, 3), reader(precision)
    viscosity, drag = laws.get("term"), laws.get("drag")
    viscous = viscosity is not None

    def push(i: int, j: int, x_ij: vec3, r2: real, d: data, p: params):
        apart = r2 > p.closest_squared
        side = wp.where(d.slot[i] < d.slot[j], -p.smoothing_length, p.smoothing_length)
        distance2 = wp.where(apart, r2, p.smoothing_length * p.smoothing_length)
        state_i = state_of(d.state, i)
        state_j = state_of(d.state, j)
        stress = state_i[2] + state_j[2]
        if wp.static(viscous):
            v_ij = velocity_of(d.v, i) - velocity_of(d.v, j)
            mean = real(0.5) * (state_i + state_j)
            pi_ij = viscosity(wp.dot(v_ij, x_ij), distance2, mean[1], mean[3], p)
            if wp.static(switched):
                pi_ij *= real(0.5) * (read(d.balsara, i) + read(d.balsara, j))
            stress += pi_ij
        # In this order no factor leaves the range of float32 before the others bring it back.
        gradient = (state_j[0] * p.sigma) * slope(wp.sqrt(distance2) * p.inverse_h)
        w = (-gradient * stress * p.inverse_h) * p.inverse_h
        return pair2(w, wp.where(apart, real(0.0), side * w))

    along = function(push)
    if drag is None:
        return Term(along, 3, DIRECTIONS[dimension], "fused")
    aside = vec3(*DIRECTIONS[dimension])

    def push_and_drag(i: int, j: int, x_ij: vec3, r2: real, d: data, p: params):
        t = along(i, j, x_ij, r2, d, p)
        state_i = state_of(d.state, i)
        state_j = state_of(d.state, j)
        v_ij = velocity_of(d.v, i) - velocity_of(d.v, j)
        D = drag(r2, state_i[1], state_j[1], real(0.5) * (state_i[3] + state_j[3]), p)
        gradient = (state_j[0] * p.sigma) * slope(wp.sqrt(r2) * p.inverse_h)
        w = (gradient * D * p.inverse_h) * p.inverse_h
        return t[0] * x_ij + t[1] * aside + w * v_ij

    return Term(function(push_and_drag), 3, None, "fused")


def virial_term(force: Term, precision: Precision, data: Any, params: Any) -> Term:
    """Term x_ij . f_ij / 2, the particle's share of the virial."""
    real, vec3, one = precision.scalar, precision.vec3, precision.vector(1)
    push, central = force.function, force.direction is not None

    def add_virial(i: int, j: int, x_ij: vec3, r2: real, d: data, p: params):
        t = push(i, j, x_ij, r2, d, p)
        if wp.static(central):
            w = t[0] * wp.dot(x_ij, x_ij)
        else:
            w = wp.dot(t, x_ij)
        return one(real(0.5) * d.m[i] * w)

    return Term(function(add_virial), 1)


@functools.cache
def add_force(precision: Precision, data: Any, params: Any, out: Any) -> wp.Function:
    """Store: f += m_i sum."""
    vec3 = precision.vec3

    def add_to_force(i: int, particle: int, total: vec3, d: data, p: params, o: out):
        o.f[particle] = o.f[particle] + d.m[i] * total

    return function(add_to_force)


@functools.cache
def keep_measure(
    energy: wp.Function, precision: Precision, data: Any, params: Any, out: Any
) -> wp.Function:
    """Store: the particle's energy m u(rho) and its share of the virial."""
    one = precision.vector(1)

    def keep(i: int, particle: int, total: one, d: data, p: params, o: out):
        u = energy(d.state[i][1], p)
        o.energy[particle] = o.energy[particle] + wp.float64(d.m[i] * u)
        o.virial[particle] = o.virial[particle] + wp.float64(total[0])

    return function(keep)
