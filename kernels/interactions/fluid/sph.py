"""Smoothed particle hydrodynamics: terms of pairs, what is kept of their sums, interpolation.

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

from ...engine.loops import Periodicity, Term, box_type, minimum_image, reader
from ...precision import Precision, function, function_from_source, register
from ...warp_internals import arguments as arguments_of

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
def own_weight(weight: wp.Function, precision: Precision, data: Any, params: Any) -> wp.Function:
    """``own(i, d, p)``: w(0)."""
    real = precision.scalar

    def own(i: int, d: data, p: params):
        return weight(real(0.0))

    return function(own)


@functools.cache
def keep_state(
    own: wp.Function, pressure: wp.Function, sound_speed: wp.Function | None, hot: bool,
    precision: Precision, data: Any, params: Any, out: Any,
) -> wp.Function:  # fmt: skip
    """Store: density and pressure of the particle, and (m, rho, P/rho^2, c) in slot order.

    ``own(i, d, p)`` is what a particle weighs in its own sum; ``sound_speed`` None leaves c at 0;
    ``hot``: the data hold internal energies u.
    """
    real, one, vec4 = precision.scalar, precision.vector(1), precision.vector(4)
    sounds = sound_speed is not None

    def keep(i: int, particle: int, total: one, d: data, p: params, o: out):
        m = d.m[i]
        rho = p.sigma * (total[0] + m * own(i, d, p))  # the sum is over the others
        u = real(0.0)
        if wp.static(hot):
            u = d.u[i]
        pressure_i = pressure(rho, u, p)
        c = real(0.0)
        if wp.static(sounds):
            c = sound_speed(rho, u, pressure_i, p)
        o.state[i] = vec4(m, rho, pressure_i / (rho * rho), c)
        o.rho[particle] = rho
        o.pressure[particle] = pressure_i

    return function(keep)


def pull_function(
    slope: wp.Function, viscosity: wp.Function | None, precision: Precision, data: Any, params: Any
) -> wp.Function:
    """``pull(i, j, approach, r2, d, p)``: w of f_ij / m_i = w x_ij, see :func:`force_term`."""
    real, state_of = precision.scalar, reader(precision, 4)
    viscous = viscosity is not None

    def pull(i: int, j: int, approach: real, distance2: real, d: data, p: params):
        state_i = state_of(d.state, i)
        state_j = state_of(d.state, j)
        stress = state_i[2] + state_j[2]
        if wp.static(viscous):
            mean = real(0.5) * (state_i + state_j)
            stress += viscosity(approach, distance2, mean[1], mean[3], p)
        # In this order no factor leaves the range of float32 before the others bring it back.
        gradient = (state_j[0] * p.sigma) * slope(wp.sqrt(distance2) * p.inverse_h)
        return (-gradient * stress * p.inverse_h) * p.inverse_h

    return function(pull)


def force_term(
    pull: wp.Function, moving: bool, dimension: int, precision: Precision, data: Any, params: Any
) -> Term:
    """Term f_ij / m_i = -m_j (P_i/rho_i^2 + P_j/rho_j^2 + Pi_ij) grad_i W_ij.

    grad W vanishes with r, so coincident particles are taken as h apart along a fixed direction,
    in the order of their slots: they push each other apart, equally and opposite. ``moving``: the
    approach counts.
    """
    real, vec3, pair2 = precision.scalar, precision.vec3, precision.vector(2)
    velocity_of = reader(precision, 3)

    def push(i: int, j: int, x_ij: vec3, r2: real, d: data, p: params):
        apart = r2 > p.closest_squared
        side = wp.where(d.slot[i] < d.slot[j], -p.smoothing_length, p.smoothing_length)
        distance2 = wp.where(apart, r2, p.smoothing_length * p.smoothing_length)
        approach = real(0.0)
        if wp.static(moving):
            approach = wp.dot(velocity_of(d.v, i) - velocity_of(d.v, j), x_ij)
        w = pull(i, j, approach, distance2, d, p)
        return pair2(w, wp.where(apart, real(0.0), side * w))

    return Term(function(push), 3, DIRECTIONS[dimension], "fused")


def heat_term(
    slope: wp.Function, viscosity: wp.Function | None, dimension: int, kicks: int,
    precision: Precision, data: Any, params: Any,
) -> Term:  # fmt: skip
    """Term m_j (P_i/rho_i^2 + Pi_ij/2) u_ij . grad_i W_ij of heat, at the mean velocities of kicks.

    Coincident particles are taken as h apart, as by the force.
    """
    real, vec3, result = precision.scalar, precision.vec3, precision.vector(kicks)
    state_of, vector_of = reader(precision, 4), reader(precision, 3)
    aside = vec3(*DIRECTIONS[dimension])
    viscous, both = viscosity is not None, kicks == 2

    def warm(i: int, j: int, x_ij: vec3, r2: real, d: data, p: params):
        apart = r2 > p.closest_squared
        side = wp.where(d.slot[i] < d.slot[j], -p.smoothing_length, p.smoothing_length)
        distance2 = wp.where(apart, r2, p.smoothing_length * p.smoothing_length)
        along = x_ij + wp.where(apart, real(0.0), side) * aside
        state_i = state_of(d.state, i)
        state_j = state_of(d.state, j)
        stress = state_i[2]
        if wp.static(viscous):
            v_ij = vector_of(d.v, i) - vector_of(d.v, j)
            mean = real(0.5) * (state_i + state_j)
            term = viscosity(wp.dot(v_ij, x_ij), distance2, mean[1], mean[3], p)
            stress += real(0.5) * term
        gradient = (state_j[0] * p.sigma) * slope(wp.sqrt(distance2) * p.inverse_h)
        g = (gradient * stress * p.inverse_h) * p.inverse_h
        rate = result()
        rate[0] = g * wp.dot(vector_of(d.u0, i) - vector_of(d.u0, j), along)
        if wp.static(both):
            rate[1] = g * wp.dot(vector_of(d.u1, i) - vector_of(d.u1, j), along)
        return rate

    return Term(function(warm), kicks)


def virial_term(force: Term, precision: Precision, data: Any, params: Any) -> Term:
    """Term x_ij . f_ij / 2, the particle's share of the virial."""
    real, vec3, one = precision.scalar, precision.vec3, precision.vector(1)
    push = force.function

    def add_virial(i: int, j: int, x_ij: vec3, r2: real, d: data, p: params):
        t = push(i, j, x_ij, r2, d, p)
        return one(real(0.5) * d.m[i] * t[0] * wp.dot(x_ij, x_ij))

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
    energy: wp.Function, hot: bool, precision: Precision, data: Any, params: Any, out: Any
) -> wp.Function:
    """Store: the particle's energy m u and its share of the virial."""
    real, one = precision.scalar, precision.vector(1)

    def keep(i: int, particle: int, total: one, d: data, p: params, o: out):
        u = real(0.0)
        if wp.static(hot):
            u = d.u[i]
        u = energy(d.state[i][1], u, p)
        o.energy[particle] = o.energy[particle] + wp.float64(d.m[i] * u)
        o.virial[particle] = o.virial[particle] + wp.float64(total[0])

    return function(keep)


@functools.cache
def interpolation_kernel(
    weight: wp.Function, precision: Precision, periodic: Periodicity, params: Any, own: bool = False
) -> wp.Kernel:
    """Kernel: sum_j V_j A_j W(r - r_j, h) and sum_j V_j W(r - r_j, h) at each point r.

    ``samples`` are (V_j A_j, V_j), the volumes being m_j / rho_j; ``sizes`` (1/h_j, sigma/h_j^d)
    where particles have lengths of their own.
    """
    real, vec3, vec4, Box = (
        precision.scalar, precision.vec3, precision.vector(4), box_type(precision),
    )  # fmt: skip
    image, vec2 = minimum_image(precision, periodic), precision.vector(2)

    @register
    def interpolate(
        first: int,
        grid: wp.uint64,
        world: int,
        box: wp.array(dtype=Box),
        parameters: wp.array(dtype=params),
        x: wp.array(dtype=vec3),
        samples: wp.array(dtype=vec4),
        sizes: wp.array(dtype=vec2),
        points: wp.array(dtype=vec3),
        u: wp.array(dtype=vec3),
        sums_out: wp.array(dtype=vec4),
    ):
        k = first + wp.tid()
        p = parameters[world]
        total = vec4()
        j = int(0)
        candidates = wp.hash_grid_query(grid, u[k], real(1.0))
        while wp.hash_grid_query_next(candidates, j):
            x_ij = image(points[k] - x[j], box[world])
            r2 = wp.dot(x_ij, x_ij)
            if r2 < p.cutoff_squared:
                r = wp.sqrt(r2)
                if wp.static(own):
                    total += samples[j] * (weight(r * sizes[j][0]) * sizes[j][1])
                else:
                    total += samples[j] * weight(r * p.inverse_h)
        if wp.static(not own):
            total *= p.sigma
        sums_out[k] = total

    return interpolate
