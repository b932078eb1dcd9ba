"""Density by continuity: how fast particles of a fluid approach, and what evens out the noise.

Over an interval in which particles go straight on, the density changes by

    d rho_i = dt (sum_j m_j v_ij . grad_i W_ij + D_i)                        (Monaghan 1994)

taken where particles are in its middle, x_ij - v_ij dt / 2, of second order in dt. Images in walls
(see :mod:`.images`) count with d(r'^2 / 2)/dt as mirrors move: the rate is that of the sum over the
images, whether the fluid sticks or slips. Densities are kept as what they have in ``excess`` of the
rest density, whose small changes rounding leaves alone.

    D_i = delta h c sum_j V_j (2 (rho_j - rho_i) x_ji / r^2 - g_i - g_j) . grad_i W_ij

evens out densities (Molteni and Colagrossi 2009) but for what is linear in space, by the gradients
g = M^-1 sum_j V_j (rho_j - rho_i) grad_i W_ij, M = sum_j V_j x_ji grad_i W_ij (Antuono et al.
2010). Both are sums over particles alone: what is linear up to a wall or a surface stays so.
"""

import functools
from typing import Any

import warp as wp

from ...engine.loops import Pairs, Term, reader
from ...precision import Precision, function, register
from . import images
from .seen import Seen

LEAST = 1e-3  # of the rest density, below which no density falls
# Added to the diagonal of M, which is about 1: directions in which there are no neighbours have no
# gradient, and others lose that part of theirs.
REGULAR = 1e-4


@functools.cache
def gather_kernel(precision: Precision) -> wp.Kernel:
    """Kernel: in slot order, excess densities and how long ago they were those."""
    real = precision.scalar

    @register
    def gather_excess(
        first: int,
        pairs: Pairs,
        excess: wp.array(dtype=real),
        time: wp.array(dtype=wp.float64),
        since: wp.array(dtype=wp.float64),
        excess_out: wp.array(dtype=real),
        lag_out: wp.array(dtype=real),
    ):
        i = first + wp.tid()
        w = pairs.world[i]
        excess_out[i] = excess[pairs.order[i]]
        lag_out[i] = real(time[w] - since[w])

    return gather_excess


def gradient_term(slope: wp.Function, precision: Precision, data: Any, params: Any) -> Term:
    """Term of M, six numbers, and of the sum that it is to be divided out of, in units of h."""
    real, vec3, nine = precision.scalar, precision.vec3, precision.vector(9)
    read = reader(precision)

    def add_gradient(i: int, j: int, x_ij: vec3, r2: real, d: data, p: params):
        excess_j = read(d.excess, j)
        volume = read(d.m, j) * p.sigma / (p.rest_density + excess_j)
        w = -volume * slope(wp.sqrt(r2) * p.inverse_h)
        y = x_ij * p.inverse_h
        b = (read(d.excess, i) - excess_j) * w
        return nine(
            w * y[0] * y[0], w * y[1] * y[1], w * y[2] * y[2], w * y[1] * y[2], w * y[2] * y[0],
            w * y[0] * y[1], b * y[0], b * y[1], b * y[2],
        )  # fmt: skip

    return Term(function(add_gradient), 9)


@functools.cache
def solve_function(precision: Precision) -> wp.Function:
    """``solve(s)``: M^-1 b of these nine numbers, M symmetric, by its factors L D L^T.

    An inverse by minors would lose to rounding what few neighbours leave of it.
    """
    real, vec3, nine = precision.scalar, precision.vec3, precision.vector(9)

    def solve(s: nine):
        least = real(REGULAR)
        d_0 = s[0] + least
        l_10 = s[5] / d_0
        l_20 = s[4] / d_0
        d_1 = wp.max(s[1] + least - l_10 * s[5], least)
        a = s[3] - l_10 * s[4]
        l_21 = a / d_1
        d_2 = wp.max(s[2] + least - l_20 * s[4] - l_21 * a, least)
        y_1 = s[7] - l_10 * s[6]
        g_2 = (s[8] - l_20 * s[6] - l_21 * y_1) / d_2
        g_1 = y_1 / d_1 - l_21 * g_2
        return vec3(s[6] / d_0 - l_10 * g_1 - l_20 * g_2, g_1, g_2)

    return function(solve)


@functools.cache
def keep_gradient(
    pressure: wp.Function, sound_speed: wp.Function, precision: Precision, data: Any, params: Any,
    out: Any,
) -> wp.Function:  # fmt: skip
    """Store: (h g, c) of every slot."""
    real, vec4, nine = precision.scalar, precision.vector(4), precision.vector(9)
    solve = solve_function(precision)

    def keep(i: int, particle: int, s: nine, d: data, p: params, o: out):
        rho = p.rest_density + d.excess[i]
        c = sound_speed(rho, real(0.0), pressure(rho, real(0.0), p), p)
        g = solve(s)
        o.gradient[i] = vec4(g[0], g[1], g[2], c)

    return function(keep)


@functools.cache
def gain_function(
    slope: wp.Function, precision: Precision, data: Any, params: Any
) -> wp.Function:  # fmt: skip
    """``gain(i, approach, speed2, r2, d, p)``: (w', w' v.x) in the middle of the interval.

    With w' for W'/r but for its normalisation; ``approach`` is v . x, and ``speed2`` v . v.
    """
    real, two, read = precision.scalar, precision.vector(2), reader(precision)

    def gain(i: int, approach: real, speed2: real, r2: real, d: data, p: params):
        lag = read(d.lag, i)
        middle = approach - real(0.5) * lag * speed2
        square = r2 - lag * (approach - real(0.25) * lag * speed2)
        w = slope(wp.sqrt(wp.max(square, p.closest_squared)) * p.inverse_h)
        return two(w, w * middle)

    return function(gain)


def rate_term(
    slope: wp.Function, diffuses: bool, precision: Precision, data: Any, params: Any
) -> Term:  # fmt: skip
    """Term of the rate of the density times h^2."""
    vec3, real, one = precision.vec3, precision.scalar, precision.vector(1)
    gained = gained_function(slope, diffuses, precision, data, params)

    def add_rate(i: int, j: int, x_ij: vec3, r2: real, d: data, p: params):
        return one(gained(i, j, x_ij, r2, d, p))

    return Term(function(add_rate), 1)


@functools.cache
def gained_function(
    slope: wp.Function, diffuses: bool, precision: Precision, data: Any, params: Any
) -> wp.Function:  # fmt: skip
    """``gained(i, j, x_ij, r2, d, p)``: what a pair, of particles alone, has in that term."""
    vec3, real = precision.vec3, precision.scalar
    read, vector_of, four_of = reader(precision), reader(precision, 3), reader(precision, 4)
    gain = gain_function(slope, precision, data, params)

    def gained(i: int, j: int, x_ij: vec3, r2: real, d: data, p: params):
        v_ij = vector_of(d.move, i) - vector_of(d.move, j)
        found = gain(i, wp.dot(v_ij, x_ij), wp.dot(v_ij, v_ij), r2, d, p)
        m = read(d.m, j) * p.sigma
        rate = m * found[1]
        if wp.static(diffuses):
            excess_j = read(d.excess, j)
            both = four_of(d.gradient, i) + four_of(d.gradient, j)
            along = both[0] * x_ij[0] + both[1] * x_ij[1] + both[2] * x_ij[2]
            uneven = real(2.0) * (read(d.excess, i) - excess_j) - along * p.inverse_h
            spread = p.density_diffusion * p.smoothing_length * real(0.5) * both[3]
            rate += spread * (m / (p.rest_density + excess_j)) * found[0] * uneven
        return rate

    return function(gained)


def _images(seen: Seen) -> list[str]:
    """Source that adds the gain of all images to ``found``."""
    lines = [
        *images.square_lines(seen),
        *(
            f"a{a} = real(2.0) * (R_i[{a}] * D_j[{a}] + D_i[{a}] * R_j[{a}])"
            for a in range(seen.places)
        ),
        *(f"b{a} = real(4.0) * R_i[{a}] * R_j[{a}]" for a in range(seen.places)),
    ]
    for each in seen.sets:
        r2, a, b = (" + ".join(f"{name}{k}" for k in each) for name in "eab")
        lines.append(f"found += gain(i, approach + {a}, speed2 + {b}, r2 + {r2}, d, p)[1]")
    return lines


def walled_rate_term(
    slope: wp.Function, diffuses: bool, seen: Seen, precision: Precision, data: Any, params: Any
) -> Term:  # fmt: skip
    """That term over a pair and its images."""
    lines = [
        *seen.read("D=wall", "R=rate"),
        "v_ij = velocity(d.move, i) - velocity(d.move, j)",
        "approach = wp.dot(v_ij, x_ij)",
        "speed2 = wp.dot(v_ij, v_ij)",
        "found = real(0.0)",
        *_images(seen),
    ]
    names = {
        "gain": gain_function(slope, precision, data, params), "mass": reader(precision),
        "gained": gained_function(slope, diffuses, precision, data, params),
    }  # fmt: skip
    sums = "gained(i, j, x_ij, r2, d, p) + mass(d.m, j) * p.sigma * found"
    return images.term_of("add_rates", lines, sums, 1, seen, names, precision, data, params)


@functools.cache
def own_rate(
    slope: wp.Function, seen: Seen, precision: Precision, data: Any, params: Any
) -> wp.Function:
    """``own(i, d, p)``: that of the images that a particle has of itself, for m sigma = 1."""
    lines = ["j = i", *seen.read("D=wall", "R=rate"), "r2 = real(0.0)", "approach = real(0.0)"]
    lines += ["speed2 = real(0.0)", "found = real(0.0)", *_images(seen)]
    header = "own(i: int, d: Data, p: Params)"
    names = {"gain": gain_function(slope, precision, data, params)}
    return images.function_of(header, lines, "found", seen, names, precision, data, params)


@functools.cache
def no_rate(precision: Precision, data: Any, params: Any) -> wp.Function:
    """``own(i, d, p)`` where no wall is near: 0."""
    real = precision.scalar

    def own(i: int, d: data, p: params):
        return real(0.0)

    return function(own)


@functools.cache
def keep_density(
    pressure: wp.Function, sound_speed: wp.Function | None, own: wp.Function,
    precision: Precision, data: Any, params: Any, out: Any,
) -> wp.Function:  # fmt: skip
    """Store: the density that it has come to, its pressure, and (m, rho, P/rho^2, c) by slots."""
    real, one, vec4 = precision.scalar, precision.vector(1), precision.vector(4)
    sounds = sound_speed is not None

    def keep(i: int, particle: int, total: one, d: data, p: params, o: out):
        m = d.m[i]
        rate = (total[0] + (m * p.sigma) * own(i, d, p)) * p.inverse_h * p.inverse_h
        excess = wp.max(d.excess[i] + d.lag[i] * rate, real(LEAST - 1.0) * p.rest_density)
        rho = p.rest_density + excess
        pressure_i = pressure(rho, real(0.0), p)
        c = real(0.0)
        if wp.static(sounds):
            c = sound_speed(rho, real(0.0), pressure_i, p)
        o.state[i] = vec4(m, rho, pressure_i / (rho * rho), c)
        o.rho[particle] = rho
        o.pressure[particle] = pressure_i
        o.excess[particle] = excess

    return function(keep)


@functools.cache
def keep_sum(
    weight: wp.Function, precision: Precision, data: Any, params: Any, out: Any
) -> wp.Function:
    """Store: the density as a sum over particles."""
    real, one = precision.scalar, precision.vector(1)

    def keep(i: int, particle: int, total: one, d: data, p: params, o: out):
        o.rho[particle] = p.sigma * (total[0] + d.m[i] * weight(real(0.0)))

    return function(keep)
