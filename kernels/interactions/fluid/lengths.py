"""Smoothing lengths of particles' own: h_i that fits the density, and forces that know of it.

Each particle has as much of its neighbours in reach as any other, in its own masses:

    N(h_i) = h_i^d rho_i / m_i = sigma sum_j (m_j / m_i) w(r_ij / h_i) = eta^d

(Springel and Hernquist 2002, eq. 4; Price 2012, eqs. 10 and 11). N rises with h, so there is one
such h, found by Newton's steps on ln N over ln h within a bracket, each particle by itself. With

    Omega_i = d ln N / d ln h / d = -sum_j m_j q^2 (w'/q)(q) / (d sum_j m_j w(q)),    q = r_ij / h_i

a force that derives from sum_i m_i u(rho_i, h_i(rho_i)) is (Price 2012, eq. 30)

    f_i = -m_i sum_j m_j (P_i/(Omega_i rho_i^2) grad W(h_i) + P_j/(Omega_j rho_j^2) grad W(h_j))
"""

import functools
from types import SimpleNamespace
from typing import Any

import warp as wp

from ...engine.loops import Term, reader
from ...precision import Precision, function, register
from .sph import DIRECTIONS

SURE = 0.3  # of d: a slope of ln N below which its step is not to be trusted
LONGEST = 0.5  # step of ln h
LEAST = 0.1  # Omega of what has its neighbours in its very middle
SEARCHES, DONE = 0, 1


@functools.cache
def length_kernels(precision: Precision) -> SimpleNamespace:
    """Kernels around the sums by which lengths are found."""
    real, vec2, vec4 = precision.scalar, precision.vector(2), precision.vector(4)

    @register
    def begin_search(
        first: int,
        order: wp.array(dtype=wp.int32),
        world: wp.array(dtype=wp.int32),
        bounds: wp.array(dtype=vec2),
        factor: real,
        reach: wp.array(dtype=real),
        h: wp.array(dtype=real),
        bracket_out: wp.array(dtype=vec4),
        next_out: wp.array(dtype=real),
        state_out: wp.array(dtype=wp.int32),
    ):
        """From the last length, within bounds and no farther than partners are listed."""
        i = first + wp.tid()
        particle = order[i]
        b = bounds[world[i]]
        most = wp.max(b[0], wp.min(b[1], reach[particle] / factor))
        bracket_out[i] = vec4(b[0], most, b[0], most)
        next_out[i] = wp.clamp(h[particle], b[0], most)
        state_out[i] = wp.static(SEARCHES)

    @register
    def take_step(
        first: int,
        following: wp.array(dtype=real),
        sigma: real,
        dimension: int,
        size_out: wp.array(dtype=vec2),
    ):
        """1/h and sigma/h^d of the lengths to be tried."""
        i = first + wp.tid()
        h = following[i]
        one = real(1.0) / h
        s = sigma
        for _n in range(dimension):
            s *= one
        size_out[i] = vec2(one, s)

    return SimpleNamespace(begin=begin_search, step=take_step)


def length_term(
    weight: wp.Function, slope: wp.Function, precision: Precision, data: Any, params: Any
) -> Term:
    """Term (m_j w(q), m_j q^2 (w'/q)(q)) with q = r / h_i."""
    real, vec3, pair2 = precision.scalar, precision.vec3, precision.vector(2)
    read, size_of = reader(precision), reader(precision, 2)

    def add_both(i: int, j: int, x_ij: vec3, r2: real, d: data, p: params):
        size = size_of(d.size, i)
        q2 = wp.min(r2 * size[0] * size[0], real(16.0))  # beyond any support
        q = wp.sqrt(q2)
        m = read(d.m, j)
        return pair2(m * weight(q), m * q2 * slope(q))

    return Term(function(add_both), 2, rounding="fused")


@functools.cache
def keep_length(
    weight: wp.Function, pressure: wp.Function, sound_speed: wp.Function | None, hot: bool,
    dimension: int, precision: Precision, data: Any, params: Any, out: Any,
) -> wp.Function:  # fmt: skip
    """Store: what a particle is at the length tried, and the next one unless it fits.

    (m, rho, P/(Omega rho^2), c) in slot order. A length at the end of what it may be is fixed, and
    Omega 1.
    """
    real, pair2, vec4 = precision.scalar, precision.vector(2), precision.vector(4)
    sounds, d_real = sound_speed is not None, real(float(dimension))

    def keep(i: int, particle: int, total: pair2, d: data, p: params, o: out):
        if o.found[i] == wp.static(DONE):
            return
        m = d.m[i]
        h = o.following[i]
        size = d.size[i]
        mass = total[0] + m * weight(real(0.0))  # the sums are over the others
        slope = wp.max(-total[1] / mass, real(0.0))
        step = (p.target - wp.log(p.normal * mass / m)) / wp.max(slope, real(SURE) * d_real)
        bracket = o.bracket[i]
        low = bracket[0]
        high = bracket[1]
        least = bracket[2]
        most = bracket[3]
        bound = (step > real(0.0) and h >= most) or (step < real(0.0) and h <= least)
        if bound or wp.abs(step) < p.tolerance or high <= low * (real(1.0) + p.tolerance):
            o.found[i] = wp.static(DONE)
        else:
            # The ends of the bracket have been tried, but for those that it began with.
            if step > real(0.0):
                low = h * (real(1.0) + real(0.5) * p.tolerance)
            else:
                high = h * (real(1.0) - real(0.5) * p.tolerance)
            o.bracket[i] = vec4(low, high, least, most)
            farther = h * wp.exp(wp.clamp(step, -real(LONGEST), real(LONGEST)))
            tried = (farther >= high and high < most) or (farther <= low and low > least)
            o.following[i] = wp.where(tried, wp.sqrt(low * high), wp.clamp(farther, low, high))
            if o.searching[0] == 0:
                o.searching[0] = 1
        rho = size[1] * mass
        u = real(0.0)
        if wp.static(hot):
            u = d.u[i]
        pressure_i = pressure(rho, u, h, p)
        c = real(0.0)
        if wp.static(sounds):
            c = sound_speed(rho, u, pressure_i, h, p)
        omega = wp.where(bound, real(1.0), wp.max(slope / d_real, real(LEAST)))
        o.state[i] = vec4(m, rho, pressure_i / (omega * rho * rho), c)
        o.h[particle] = h
        o.rho[particle] = rho
        o.pressure[particle] = pressure_i

    return function(keep)


def force_term(
    slope: wp.Function, viscosity: wp.Function | None, dimension: int, precision: Precision,
    data: Any, params: Any,
) -> Term:  # fmt: skip
    """Term f_ij / m_i = -m_j sum over both of (P/(Omega rho^2) + Pi_ij/2) grad W(h).

    Coincident particles are taken as a mean length apart, as by :func:`.sph.force_term`.
    """
    real, vec3, pair2 = precision.scalar, precision.vec3, precision.vector(2)
    state_of, velocity_of, size_of = (reader(precision, k) for k in (4, 3, 2))
    viscous = viscosity is not None

    def push(i: int, j: int, x_ij: vec3, r2: real, d: data, p: params):
        size_i = size_of(d.size, i)
        size_j = size_of(d.size, j)
        h = real(0.5) / size_i[0] + real(0.5) / size_j[0]
        apart = r2 > p.closest_squared
        side = wp.where(d.slot[i] < d.slot[j], -h, h)
        distance2 = wp.where(apart, r2, h * h)
        state_i = state_of(d.state, i)
        state_j = state_of(d.state, j)
        share = real(0.0)
        if wp.static(viscous):
            v_ij = velocity_of(d.v, i) - velocity_of(d.v, j)
            mean = real(0.5) * (state_i + state_j)
            term = viscosity(wp.dot(v_ij, x_ij), distance2, mean[1], mean[3], h, p)
            share = real(0.5) * term
        r = wp.sqrt(distance2)
        # In this order no factor leaves the range of float32 before the others bring it back.
        of_i = (state_j[0] * size_i[1]) * slope(r * size_i[0])
        of_j = (state_j[0] * size_j[1]) * slope(r * size_j[0])
        of_i = (of_i * (state_i[2] + share) * size_i[0]) * size_i[0]
        of_j = (of_j * (state_j[2] + share) * size_j[0]) * size_j[0]
        w = -of_i - of_j
        return pair2(w, wp.where(apart, real(0.0), side * w))

    return Term(function(push), 3, DIRECTIONS[dimension], "fused")


def heat_term(
    slope: wp.Function, viscosity: wp.Function | None, dimension: int, kicks: int,
    precision: Precision, data: Any, params: Any,
) -> Term:  # fmt: skip
    """Term m_j u_ij . (P_i/(Omega_i rho_i^2) grad W(h_i) + Pi_ij/4 (grad W(h_i) + grad W(h_j))).

    What the force of a pair does, at the mean velocities u of each kick (see :mod:`.heat`).
    """
    real, vec3, result = precision.scalar, precision.vec3, precision.vector(kicks)
    state_of, vector_of, size_of = (reader(precision, k) for k in (4, 3, 2))
    aside = vec3(*DIRECTIONS[dimension])
    viscous, both = viscosity is not None, kicks == 2

    def warm(i: int, j: int, x_ij: vec3, r2: real, d: data, p: params):
        size_i = size_of(d.size, i)
        size_j = size_of(d.size, j)
        h = real(0.5) / size_i[0] + real(0.5) / size_j[0]
        apart = r2 > p.closest_squared
        side = wp.where(d.slot[i] < d.slot[j], -h, h)
        distance2 = wp.where(apart, r2, h * h)
        along = x_ij + wp.where(apart, real(0.0), side) * aside
        state_i = state_of(d.state, i)
        state_j = state_of(d.state, j)
        r = wp.sqrt(distance2)
        of_i = (state_j[0] * size_i[1]) * slope(r * size_i[0])
        g = (of_i * state_i[2] * size_i[0]) * size_i[0]
        if wp.static(viscous):
            v_ij = vector_of(d.v, i) - vector_of(d.v, j)
            mean = real(0.5) * (state_i + state_j)
            term = viscosity(wp.dot(v_ij, x_ij), distance2, mean[1], mean[3], h, p)
            quarter = real(0.25) * term
            of_j = (state_j[0] * size_j[1]) * slope(r * size_j[0])
            g += (of_i * quarter * size_i[0]) * size_i[0] + (of_j * quarter * size_j[0]) * size_j[0]
        rate = result()
        rate[0] = g * wp.dot(vector_of(d.u0, i) - vector_of(d.u0, j), along)
        if wp.static(both):
            rate[1] = g * wp.dot(vector_of(d.u1, i) - vector_of(d.u1, j), along)
        return rate

    return Term(function(warm), kicks)
