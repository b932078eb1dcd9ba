"""Smoothed particle hydrodynamics: terms of pairs, and what is kept of their sums.

Two passes over one neighbour list. The first sums the density and keeps each particle's state in
slot order; the second sums the force from the states of both particles:

    rho_i = sum_j m_j W_ij
    f_i   = -m_i sum_j m_j (P_i/rho_i^2 + P_j/rho_j^2 + Pi_ij) grad_i W_ij

Laws of the fluid reach the terms bound to their parameters (see :mod:`.laws`). Everything between
a neighbour's index and its contribution is free of branches, so that the loops vectorise.

Where a fluid is ``several`` ones, "m" is one weight for all particles in place of the mass, and
"rho" what that makes of their number: then rho_i = m_i n_i (Hu and Adams 2006), and pressures push
by P/n^2. Only laws ask for masses and densities as they are, by the ``share`` m_i of a weight.
"""

import functools
from typing import Any

import warp as wp

from ...engine.loops import Term, reader
from ...precision import Precision, function

# Where coincident particles are pushed along, within the line or plane of a lower dimension.
DIRECTIONS = {1: (1.0, 0.0, 0.0), 2: (0.6, 0.8, 0.0), 3: (0.48, 0.6, 0.64)}


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
    pressure: wp.Function, sound_speed: wp.Function | None, hot: bool, several: bool,
    own: wp.Function, precision: Precision, data: Any, params: Any, out: Any,
) -> wp.Function:  # fmt: skip
    """Store: density and pressure of the particle, and (m, rho, P/rho^2, c) in slot order.

    ``own(i, d, p)`` is what a particle weighs in its own sum; ``sound_speed`` None leaves c at 0;
    ``hot``: the data hold internal energies u; ``several``: and which fluid each is of.
    """
    real, one, vec4 = precision.scalar, precision.vector(1), precision.vector(4)
    sounds = sound_speed is not None

    def keep(i: int, particle: int, total: one, d: data, p: params, o: out):
        m = d.m[i]
        n = p.sigma * (total[0] + m * own(i, d, p))  # the sum is over the others
        rho = n
        u = real(0.0)
        if wp.static(hot):
            u = d.u[i]
        c = real(0.0)
        if wp.static(several):
            rho = n * (d.mass[i] * p.share)
            pressure_i = pressure(rho, u, d.fluid[i], p)
            if wp.static(sounds):
                c = sound_speed(rho, u, pressure_i, d.fluid[i], p)
        else:
            pressure_i = pressure(rho, u, p)
            if wp.static(sounds):
                c = sound_speed(rho, u, pressure_i, p)
        o.state[i] = vec4(m, n, pressure_i / (n * n), c)
        o.rho[particle] = rho
        o.pressure[particle] = pressure_i

    return function(keep)


def pull_function(
    slope: wp.Function, viscosity: wp.Function | None, switched: bool, several: bool,
    precision: Precision, data: Any, params: Any,
) -> wp.Function:  # fmt: skip
    """``pull(i, j, approach, r2, d, p)``: w of f_ij / m_i = w x_ij, see :func:`force_term`."""
    real, state_of, read = precision.scalar, reader(precision, 4), reader(precision)
    viscous = viscosity is not None

    def pull(i: int, j: int, approach: real, distance2: real, d: data, p: params):
        state_i = state_of(d.state, i)
        state_j = state_of(d.state, j)
        stress = state_i[2] + state_j[2]
        if wp.static(viscous):
            mean = real(0.5) * (state_i + state_j)
            density = mean[1]
            if wp.static(several):
                share_i = read(d.mass, i) * p.share
                share_j = read(d.mass, j) * p.share
                density = real(0.5) * (share_i * state_i[1] + share_j * state_j[1])
            pi_ij = viscosity(approach, distance2, density, mean[3], p)
            if wp.static(several):
                pi_ij *= share_i * share_j
            if wp.static(switched):
                pi_ij *= real(0.5) * (read(d.balsara, i) + read(d.balsara, j))
            stress += pi_ij
        else:
            # Nothing, as no speed of sound is below 0. A loop that leaves out the last of numbers
            # that lie side by side does not vectorise, and takes ten times as long.
            stress += wp.min(state_j[3], real(0.0))
        # In this order no factor leaves the range of float32 before the others bring it back.
        gradient = (state_j[0] * p.sigma) * slope(wp.sqrt(distance2) * p.inverse_h)
        return (-gradient * stress * p.inverse_h) * p.inverse_h

    return function(pull)


def drag_function(
    slope: wp.Function, drag: wp.Function, several: bool, precision: Precision, data: Any,
    params: Any,
) -> wp.Function:  # fmt: skip
    """``dragged(i, j, r2, d, p)``: w of f_ij / m_i = w v_ij, m_j D_ij W_ij' / r."""
    real, state_of, read = precision.scalar, reader(precision, 4), reader(precision)

    def dragged(i: int, j: int, r2: real, d: data, p: params):
        state_i = state_of(d.state, i)
        state_j = state_of(d.state, j)
        c = real(0.5) * (state_i[3] + state_j[3])
        if wp.static(several):
            share_i = read(d.mass, i) * p.share
            share_j = read(d.mass, j) * p.share
            rho_i, rho_j = share_i * state_i[1], share_j * state_j[1]
            D = drag(r2, rho_i, rho_j, c, read(d.fluid, i), read(d.fluid, j), p)
            D *= share_i * share_j
        else:
            D = drag(r2, state_i[1], state_j[1], c, p)
        gradient = (state_j[0] * p.sigma) * slope(wp.sqrt(r2) * p.inverse_h)
        return (gradient * D * p.inverse_h) * p.inverse_h

    return function(dragged)


def force_term(
    pull: wp.Function, dragged: wp.Function | None, moving: bool, dimension: int,
    precision: Precision, data: Any, params: Any,
) -> Term:  # fmt: skip
    """Term f_ij / m_i = -m_j (P_i/rho_i^2 + P_j/rho_j^2 + Pi_ij) grad_i W_ij + w_ij v_ij.

    grad W vanishes with r, so coincident particles are taken as h apart along a fixed direction,
    in the order of their slots: they push each other apart, equally and opposite.

    Args:
        pull: Of the first part (see :func:`pull_function`).
        dragged: Of the second; None: there is none, and the term is central.
        moving: The approach counts.
        dimension: Of the fluid.
        precision: Of the simulation.
        data: Struct with ``state`` and, where it moves, ``v``.
        params: Struct of the fluid's parameters.
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

    along = function(push)
    if dragged is None:
        return Term(along, 3, DIRECTIONS[dimension], "fused")
    aside = vec3(*DIRECTIONS[dimension])

    def push_and_drag(i: int, j: int, x_ij: vec3, r2: real, d: data, p: params):
        t = along(i, j, x_ij, r2, d, p)
        v_ij = velocity_of(d.v, i) - velocity_of(d.v, j)
        return t[0] * x_ij + t[1] * aside + dragged(i, j, r2, d, p) * v_ij

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
    energy: wp.Function, hot: bool, own: bool, several: bool, precision: Precision, data: Any,
    params: Any, out: Any,
) -> wp.Function:  # fmt: skip
    """Store: the particle's energy m u and its share of the virial.

    ``own``: it has a smoothing length of its own, which the law takes too; ``several``: it is
    of one of several fluids.
    """
    real, one = precision.scalar, precision.vector(1)

    def keep(i: int, particle: int, total: one, d: data, p: params, o: out):
        u = real(0.0)
        m = d.m[i]
        if wp.static(hot):
            u = d.u[i]
        if wp.static(own):
            u = energy(d.state[i][1], u, real(1.0) / d.size[i][0], p)
        elif wp.static(several):
            m = d.mass[i]
            u = energy(d.state[i][1] * (m * p.share), u, d.fluid[i], p)
        else:
            u = energy(d.state[i][1], u, p)
        o.energy[particle] = o.energy[particle] + wp.float64(m * u)
        o.virial[particle] = o.virial[particle] + wp.float64(total[0])

    return function(keep)
