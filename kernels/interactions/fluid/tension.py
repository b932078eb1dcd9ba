"""Surface tension: the stress of the surface between fluids, by the slope of their smoothed colour.

Two passes over one neighbour list. The first sums numbers n and the slope g of a colour that is 1
in the fluid of i and 0 in the others, and keeps them in slot order; the second sums the force:

    g_i = -1/n_i sum_j grad_i W_ij over particles of other fluids
    f_i = sum_j (T_i/n_i^2 + T_j/n_j^2) grad_i W_ij,    T = s (|g| - g g / |g|)

Lengths are counted in h: N = n h^d and g h have no unit.
"""

import functools
from typing import Any

import warp as wp

from ...engine.loops import Term, reader
from ...precision import Precision, function

FLAT = 1e-3  # of 1/h: what is flatter is no surface. A flat one has some 0.7 where it lies


def slope_term(
    weight: wp.Function, slope: wp.Function, precision: Precision, data: Any, params: Any
) -> Term:
    """Term of N g h and N, both without what W is normalised by."""
    real, vec3, four = precision.scalar, precision.vec3, precision.vector(4)
    read = reader(precision)

    def add_slope(i: int, j: int, x_ij: vec3, r2: real, d: data, p: params):
        q = wp.sqrt(r2) * p.inverse_h
        other = read(d.fluid, i) != read(d.fluid, j)
        s = wp.where(other, slope(q) * p.inverse_h, real(0.0))
        return four(s * x_ij[0], s * x_ij[1], s * x_ij[2], weight(q))

    return Term(function(add_slope), 4)


@functools.cache
def surface_function(weight: wp.Function, precision: Precision, params: Any) -> wp.Function:
    """``surface(total, p) -> (g h, 1 / N)``; g is 0 where there is no surface."""
    real, four, vec3 = precision.scalar, precision.vector(4), precision.vec3

    def surface(total: four, p: params):
        one = real(1.0) / (total[3] + weight(real(0.0)))  # the sum is over the others
        g = one * vec3(total[0], total[1], total[2])
        g = wp.where(wp.length(g) > real(FLAT), g, vec3())
        return four(g[0], g[1], g[2], one / p.normal)

    return function(surface)


@functools.cache
def keep_stress(
    weight: wp.Function, precision: Precision, data: Any, params: Any, out: Any
) -> wp.Function:
    """Store: the normal g / |g| and the tension s |g| h / N^2."""
    four, vec3 = precision.vector(4), precision.vec3
    surface = surface_function(weight, precision, params)

    def keep(i: int, particle: int, total: four, d: data, p: params, o: out):
        found = surface(total, p)
        g = vec3(found[0], found[1], found[2])
        n = wp.normalize(g)
        tension = p.strength * wp.length(g) * found[3] * found[3]
        o.stress[i] = four(n[0], n[1], n[2], tension)

    return function(keep)


@functools.cache
def keep_energy(
    weight: wp.Function, precision: Precision, data: Any, params: Any, out: Any
) -> wp.Function:
    """Store: the particle's energy s |g| / n."""
    four, vec3 = precision.vector(4), precision.vec3
    surface = surface_function(weight, precision, params)

    def keep(i: int, particle: int, total: four, d: data, p: params, o: out):
        found = surface(total, p)
        size = wp.length(vec3(found[0], found[1], found[2])) * found[3]
        energy = p.strength * size / (p.inverse_h * p.inverse_h)
        o.energy[particle] = o.energy[particle] + wp.float64(energy)

    return function(keep)


def force_term(slope: wp.Function, precision: Precision, data: Any, params: Any) -> Term:
    """Term (T_i/n_i^2 + T_j/n_j^2) grad_i W_ij."""
    real, vec3, stress_of = precision.scalar, precision.vec3, reader(precision, 4)

    def pull(i: int, j: int, x_ij: vec3, r2: real, d: data, p: params):
        s_i = stress_of(d.stress, i)
        s_j = stress_of(d.stress, j)
        n_i = vec3(s_i[0], s_i[1], s_i[2])
        n_j = vec3(s_j[0], s_j[1], s_j[2])
        across = (s_i[3] * wp.dot(n_i, x_ij)) * n_i + (s_j[3] * wp.dot(n_j, x_ij)) * n_j
        w = p.normal * slope(wp.sqrt(r2) * p.inverse_h)
        return w * ((s_i[3] + s_j[3]) * x_ij - across)

    return Term(function(pull), 3)


def virial_term(force: Term, precision: Precision, data: Any, params: Any) -> Term:
    """Term x_ij . f_ij / 2, the particle's share of the virial."""
    real, vec3, one, pull = precision.scalar, precision.vec3, precision.vector(1), force.function

    def add_virial(i: int, j: int, x_ij: vec3, r2: real, d: data, p: params):
        return one(real(0.5) * wp.dot(x_ij, pull(i, j, x_ij, r2, d, p)))

    return Term(function(add_virial), 1)
