"""Passes over a fluid beside density and force: how it turns, and how else its particles move."""

import functools
from typing import Any

import warp as wp

from ...engine.loops import Term, reader
from ...precision import Precision, function

SHIFT = 8.0  # of U h, by which a shift follows the gradient of the concentration
LEAST = 1e-4  # of c / h, what a switch takes for no motion (Balsara 1995)


def turning_term(slope: wp.Function, precision: Precision, data: Any, params: Any) -> Term:
    """Term m_j (v_ij . grad W, v_ij x grad W): -rho_i times divergence and curl."""
    vec3, four = precision.vec3, precision.vector(4)
    read, velocity_of = reader(precision), reader(precision, 3)

    def add_turning(i: int, j: int, x_ij: vec3, r2: precision.scalar, d: data, p: params):
        v_ij = velocity_of(d.v, i) - velocity_of(d.v, j)
        g = (read(d.m, j) * p.sigma) * slope(wp.sqrt(r2) * p.inverse_h)
        g = g * p.inverse_h * p.inverse_h
        curl = wp.cross(v_ij, x_ij)
        return four(g * wp.dot(v_ij, x_ij), g * curl[0], g * curl[1], g * curl[2])

    return Term(function(add_turning), 4)


@functools.cache
def keep_switch(precision: Precision, data: Any, params: Any, out: Any) -> wp.Function:
    """Store: |div v| / (|div v| + |curl v| + 0.0001 c / h), 1 where nothing moves."""
    real, vec3, four = precision.scalar, precision.vec3, precision.vector(4)

    def keep(i: int, particle: int, total: four, d: data, p: params, o: out):
        state = d.state[i]
        divergence = wp.abs(total[0]) / state[1]
        curl = wp.length(vec3(total[1], total[2], total[3])) / state[1]
        whole = divergence + curl + real(LEAST) * state[3] * p.inverse_h
        o.balsara[i] = wp.where(whole > real(0.0), divergence / whole, real(1.0))

    return function(keep)


def mixing_term(
    weight: wp.Function, slope: wp.Function, precision: Precision, data: Any, params: Any
) -> Term:  # fmt: skip
    """Term m_j (v_j - v_i) W / rho, rho the mean of the pair, without what W is normalised by."""
    real, vec3 = precision.scalar, precision.vec3
    state_of, velocity_of = reader(precision, 4), reader(precision, 3)

    def add_mixing(i: int, j: int, x_ij: vec3, r2: real, d: data, p: params):
        state_j = state_of(d.state, j)
        rho = real(0.5) * (state_of(d.state, i)[1] + state_j[1])
        w = state_j[0] / rho * weight(wp.sqrt(r2) * p.inverse_h)
        return w * (velocity_of(d.v, j) - velocity_of(d.v, i))

    return Term(function(add_mixing), 3)


@functools.cache
def keep_mixing(precision: Precision, data: Any, params: Any, out: Any) -> wp.Function:
    """Store: epsilon times the sum, of particles that may move."""
    real, vec3 = precision.scalar, precision.vec3

    def keep(i: int, particle: int, total: vec3, d: data, p: params, o: out):
        moves = wp.where(o.w[particle] > real(0.0), p.viscosity_epsilon * p.sigma, real(0.0))
        o.drift[particle] = moves * total

    return function(keep)


def shifting_term(
    weight: wp.Function, slope: wp.Function, precision: Precision, data: Any, params: Any
) -> Term:  # fmt: skip
    """Term m_j grad W / rho, rho the mean of the pair, without what W is normalised by, and h^2."""
    real, vec3 = precision.scalar, precision.vec3
    state_of = reader(precision, 4)

    def add_shifting(i: int, j: int, x_ij: vec3, r2: real, d: data, p: params):
        state_j = state_of(d.state, j)
        rho = real(0.5) * (state_of(d.state, i)[1] + state_j[1])
        return (state_j[0] / rho * slope(wp.sqrt(r2) * p.inverse_h)) * x_ij

    return Term(function(add_shifting), 3)


@functools.cache
def keep_shifting(precision: Precision, data: Any, params: Any, out: Any) -> wp.Function:
    """Store: -8 U h times the sum, of particles that may move."""
    real, vec3 = precision.scalar, precision.vec3

    def keep(i: int, particle: int, total: vec3, d: data, p: params, o: out):
        shift = real(SHIFT) * p.viscosity_speed * (p.sigma * p.inverse_h)
        o.drift[particle] = wp.where(o.w[particle] > real(0.0), -shift, real(0.0)) * total

    return function(keep)
