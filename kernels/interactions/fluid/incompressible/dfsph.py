"""Divergence-free SPH: terms of pairs, and what is kept of their sums.

With k_i = P_i / rho_i^2, pressures push as in all of SPH, and densities change with velocities:

    a_i = -sum_j m_j (k_i + k_j) grad_i W_ij
    drho_i/dt = sum_j m_j v_ij . grad_i W_ij

Each is minus the transpose of the other, by masses: how densities answer to k is a symmetric
matrix A, of which A k is the rate that minus a makes. Its diagonal is

    A_ii = |sum_j m_j grad_i W_ij|^2 + m_i sum_j m_j |grad_i W_ij|^2

(Bender and Koschier 2017, eq. 9, where masses are one). Beside walls the sums go over images, which
move as mirrors have them (see :mod:`.images`).
"""

import functools
from typing import Any

import warp as wp

from ....engine.loops import Term, reader
from ....precision import Precision, function
from .. import images
from ..seen import Seen, nearest_function
from ..sph import DIRECTIONS
from ..walls import normals_of

# What is read of a pair that coincides: it is taken as h apart, along a fixed direction.
APART = [
    "apart = r2 > p.closest_squared",
    "side = wp.where(d.slot[i] < d.slot[j], -p.smoothing_length, p.smoothing_length)",
    "distance2 = wp.where(apart, r2, p.smoothing_length * p.smoothing_length)",
    "aside = direction * wp.where(apart, real(0.0), side)",
]


def steepness(
    slope: wp.Function, approaching: bool, precision: Precision, data: Any, params: Any
) -> wp.Function:
    """``steep(i, j, approach, r2, d, p)``: m_j W_ij' / r, times v_ij . x_ij if that counts."""
    real, read = precision.scalar, reader(precision)

    def steep(i: int, j: int, approach: real, distance2: real, d: data, p: params):
        gradient = (read(d.m, j) * p.sigma) * slope(wp.sqrt(distance2) * p.inverse_h)
        g = (gradient * p.inverse_h) * p.inverse_h
        if wp.static(approaching):
            g *= approach
        return g

    return function(steep)


def pressure_pull(slope: wp.Function, precision: Precision, data: Any, params: Any) -> wp.Function:
    """``pull(i, j, approach, r2, d, p)``: w of a_ij = w x_ij, by pressures alone.

    From arrays of its own: of the four numbers of a fluid's slot it would need two, and a loop that
    leaves out half of what lies side by side does not vectorise.
    """
    real, read = precision.scalar, reader(precision)
    steep = steepness(slope, False, precision, data, params)

    def pull(i: int, j: int, approach: real, distance2: real, d: data, p: params):
        return -steep(i, j, approach, distance2, d, p) * (read(d.k, i) + read(d.k, j))

    return function(pull)


def rate_term(
    steep: wp.Function, dimension: int, precision: Precision, data: Any, params: Any
) -> Term:
    """Term m_j v_ij . grad_i W_ij of the rate of density."""
    real, vec3, one = precision.scalar, precision.vec3, precision.vector(1)
    direction, velocity_of = vec3(*DIRECTIONS[dimension]), reader(precision, 3)

    def add_rate(i: int, j: int, x_ij: vec3, r2: real, d: data, p: params):
        apart = r2 > p.closest_squared
        side = wp.where(d.slot[i] < d.slot[j], -p.smoothing_length, p.smoothing_length)
        distance2 = wp.where(apart, r2, p.smoothing_length * p.smoothing_length)
        along = x_ij + direction * wp.where(apart, real(0.0), side)
        approach = wp.dot(velocity_of(d.v, i) - velocity_of(d.v, j), along)
        return one(steep(i, j, approach, distance2, d, p))

    return Term(function(add_rate), 1)


def diagonal_term(
    steep: wp.Function, dimension: int, precision: Precision, data: Any, params: Any
) -> Term:
    """Term (m_j grad_i W_ij, m_j |grad_i W_ij|^2) of the diagonal of A."""
    real, vec3, four = precision.scalar, precision.vec3, precision.vector(4)
    direction, read = vec3(*DIRECTIONS[dimension]), reader(precision)

    def add_diagonal(i: int, j: int, x_ij: vec3, r2: real, d: data, p: params):
        apart = r2 > p.closest_squared
        side = wp.where(d.slot[i] < d.slot[j], -p.smoothing_length, p.smoothing_length)
        distance2 = wp.where(apart, r2, p.smoothing_length * p.smoothing_length)
        along = x_ij + direction * wp.where(apart, real(0.0), side)
        g = steep(i, j, real(0.0), distance2, d, p)
        f = g * along
        return four(f[0], f[1], f[2], g * distance2 * (g / read(d.m, j)))

    return Term(function(add_diagonal), 4)


@functools.cache
def keep_rate(precision: Precision, data: Any, params: Any, out: Any) -> wp.Function:
    """Store: the rate of density."""
    one = precision.vector(1)

    def keep(i: int, particle: int, total: one, d: data, p: params, o: out):
        o.rate[i] = total[0]

    return function(keep)


@functools.cache
def keep_diagonal(precision: Precision, data: Any, params: Any, out: Any) -> wp.Function:
    """Store: A_ii."""
    four, vec3 = precision.vector(4), precision.vec3

    def keep(i: int, particle: int, total: four, d: data, p: params, o: out):
        own = vec3(total[0], total[1], total[2])
        o.diagonal[i] = wp.dot(own, own) + d.m[i] * total[3]

    return function(keep)


@functools.cache
def keep_acceleration(precision: Precision, data: Any, params: Any, out: Any) -> wp.Function:
    """Store: the acceleration by pressures, none of pinned particles."""
    real, vec3 = precision.scalar, precision.vec3

    def keep(i: int, particle: int, total: vec3, d: data, p: params, o: out):
        o.a[i] = total * wp.where(o.w[particle] > real(0.0), real(1.0), real(0.0))

    return function(keep)


# Beside walls --------------------------------------------------------------------------------


def walled_rate_term(
    steep: wp.Function, seen: Seen, dimension: int, precision: Precision, data: Any, params: Any
) -> Term:
    """The term of :func:`rate_term` over a pair and its images."""
    lines = [
        *APART,
        *images.pair_lines(seen),
        "found = pull(i, j, approach + wp.dot(parting, aside), distance2, d, p)",
        *images.pull_lines(seen, "j", "real(0.0)", ["found += g{n}"]),
    ]
    names = {"pull": steep, "direction": precision.vec3(*DIRECTIONS[dimension])}
    types = precision, data, params
    return images.term_of("add_rate_of_images", lines, "found", 1, seen, names, *types)


@functools.cache
def own_rate(
    steep: wp.Function, seen: Seen, precision: Precision, data: Any, params: Any
) -> wp.Function:
    """``own(i, d, p)``: the same over the images of a particle of itself."""
    lines = ["j = i", "x_ij = vec3()", "r2 = real(0.0)", *images.pair_lines(seen)]
    lines += ["found = real(0.0)"]
    lines += images.pull_lines(seen, "i", "real(0.0)", ["found += g{n}"])
    header = "own(i: int, d: Data, p: Params)"
    names = {"pull": steep}
    return images.function_of(header, lines, "found", seen, names, precision, data, params)


def walled_diagonal_term(
    steep: wp.Function, seen: Seen, dimension: int, precision: Precision, data: Any, params: Any
) -> Term:
    """The term of :func:`diagonal_term` over a pair and its images, which count as others."""
    squares = ["".join(f" + e{a}" for a in each) for each in seen.sets]
    lines = [
        *APART,
        *images.pair_lines(seen),
        "g = pull(i, j, approach, distance2, d, p)",
        "f = g * aside",
        "square = g * distance2 * (g / mass(d.m, j))",
        *images.pull_lines(seen, "j", "real(2.0) * D_j[{a}]", ["g += g{n}"]),
        "f = f + g * x_ij",
        *(f"square += g{n} * (r2{each}) * (g{n} / mass(d.m, j))" for n, each in enumerate(squares)),
    ]
    sums = ", ".join(["f[0]", "f[1]", "f[2]", "square", *(f"b{a}" for a in range(seen.places))])
    names = {
        "pull": steep, "direction": precision.vec3(*DIRECTIONS[dimension]),
        "mass": reader(precision),
    }  # fmt: skip
    types = precision, data, params
    width = 4 + seen.places
    return images.term_of("add_diagonal_of_images", lines, sums, width, seen, names, *types)


@functools.cache
def keep_walled_rate(
    own: wp.Function, precision: Precision, data: Any, params: Any, out: Any
) -> wp.Function:
    """Store: the rate of density, with what a particle's own images make of it."""
    one = precision.vector(1)

    def keep(i: int, particle: int, total: one, d: data, p: params, o: out):
        o.rate[i] = total[0] + own(i, d, p)

    return function(keep)


@functools.cache
def normals_function(seen: Seen, precision: Precision) -> wp.Function:
    """``along(N, D, b)``: normals N of the walls times what sums have for each, b."""
    total, alone, vec3 = seen.total, seen.alone, precision.vec3
    nearest, each = nearest_function(precision, total), precision.vector(total)
    places, normals = precision.vector(seen.places), normals_of(precision, total)

    def along(N: normals, D: each, b: places):
        a = vec3()
        M = nearest(D)
        for k in range(wp.static(total)):
            n = vec3(N[k, 0], N[k, 1], N[k, 2])
            if wp.static(alone):
                a = a + n * (M[k] * b[0])
            else:
                a = a + n * b[k]
        return a

    return function(along)


@functools.cache
def keep_walled_diagonal(
    own: wp.Function, seen: Seen, precision: Precision, data: Any, params: Any, out: Any
) -> wp.Function:
    """Store: A_ii; ``own`` is of ``images.own_push``, of half of what moves with the particle."""
    real, vec3, places = precision.scalar, precision.vec3, precision.vector(seen.places)
    sums, count = precision.vector(4 + seen.places), seen.places
    along = normals_function(seen, precision)

    def keep(i: int, particle: int, found: sums, d: data, p: params, o: out):
        b = own(i, d, p)
        both = places()
        for k in range(wp.static(count)):
            both[k] = found[4 + k] + real(2.0) * b[3 + k]
        whole = vec3(found[0], found[1], found[2]) + along(o.normal[i], d.wall[i], both)
        o.diagonal[i] = wp.dot(whole, whole) + d.m[i] * found[3]

    return function(keep)


@functools.cache
def keep_walled_acceleration(
    own: wp.Function, seen: Seen, precision: Precision, data: Any, params: Any, out: Any
) -> wp.Function:
    """Store: the acceleration by pressures, and how it parts from walls."""
    real, vec3, places = precision.scalar, precision.vec3, precision.vector(seen.places)
    sums, count, total = precision.vector(3 + seen.places), seen.places, seen.total
    along, each = normals_function(seen, precision), precision.vector(seen.total)

    def keep(i: int, particle: int, found: sums, d: data, p: params, o: out):
        b = own(i, d, p)
        both = places()
        for k in range(wp.static(count)):
            both[k] = found[3 + k] + b[3 + k]
        N = o.normal[i]
        a = vec3(found[0], found[1], found[2]) + along(N, d.wall[i], both)
        a = a * wp.where(o.w[particle] > real(0.0), real(1.0), real(0.0))
        parting = each()
        for k in range(wp.static(total)):
            parting[k] = wp.dot(vec3(N[k, 0], N[k, 1], N[k, 2]), a)
        o.a[i] = a
        o.parting[i] = parting

    return function(keep)
