"""Constraints on the density of a fluid: what pairs add, and what is made of the sums.

With volumes V_j and b_j = V_j sigma / h^d, lengths in h, and G = -dW/dq of a pair, the constraint
of particle i is C_i = sum_j b_j w(q_ij) - 1 <= 0. Its gradient has b_j G along the pair from every
neighbour j, and their sum from i itself. The pair passes read copies in slot order and write the
state: Jacobi, whatever the order of the threads.

Every constraint reaches tens of particles, and so as many constraints meet at each. A particle k
counts as e_k times as light as it is: sum_k w_k |sum_i g_ki l_i|^2 is how far multipliers l move
particles, g_ki the gradient of C_i by k, and by Cauchy and Schwarz at most

    sum_i l_i^2 D_i,  D_i = sum_k w_k e_k |g_ki|,  e_k largest eigenvalue of sum_i g g^T / |g|

so that l_i = C_i / D_i never overshoots, in any arrangement; that is mass splitting (Tonge,
Benevolenski and Voroshilov 2012) with parts as gradients have them. One pair is met at once, and in
the midst of a fluid it is half of the largest step that such a sweep could take.
"""

import functools
from typing import Any

import warp as wp

from ...engine.easing import SMALLEST, ease_function, easing_type
from ...engine.loops import Pairs, Term, reader
from ...precision import Precision, function, register, structure
from ..constraints import bodies_type, place_function, rounding_function
from ..contact import seen_function
from ..contact_rows import largest_eigenvalue
from ..contact_search import apart_function

STRAIGHT = 0.5  # cosine: a pair that turns by less is pushed along where it was
FARTHEST = 0.125  # of h: what a sweep moves a lone pair by at most; gradients tell no more
BEND = 3.0  # dimensions in which a density that is to fall by a part moves its particles


def density_types(precision: Precision) -> tuple[Any, Any]:
    """Slot-ordered copies that pairs read, and what their sums write and are made with."""
    vec3, real = precision.vec3, precision.scalar
    data = {
        "x": wp.array(dtype=vec3),
        "slot": wp.array(dtype=wp.int32),
        "way": wp.array(dtype=vec3),  # of this substep
        "b": wp.array(dtype=real),  # V sigma / h^d
        "free": wp.array(dtype=real),  # 1, or 0 of what is pinned: it has no constraint
        "share": wp.array(dtype=real),  # w e b
        "push": wp.array(dtype=real),  # what its multiplier grows by
        "open": wp.array(dtype=real),  # part of the surroundings that walls leave open
        "lean": wp.array(dtype=vec3),  # its gradient, times h
        "virial": wp.array(dtype=wp.float64),  # of each particle in this substep, twice its share
        "inverse_dt": real,
        "unit": real,  # of mass, as of the bodies
    }
    sums = {
        "error": wp.array(dtype=real),  # C, by slot
        "own": wp.array(dtype=real),  # w e |g| of the particle itself
        "steep": wp.array(dtype=real),  # sum of the lengths of gradients
        "share": wp.array(dtype=real),
        "push": wp.array(dtype=real),
        "lam": wp.array(dtype=real),  # by particle, over h^2
        "slack": wp.array(dtype=real),  # by particle
        "w": wp.array(dtype=real),
        "eased": real,
        "pace": real,  # of what parts from an overlap of the start, a substep; and the same in h
        "pace_in_h": real,
        "unit": real,
        "relaxation": real,
        "inverse_dt": real,
    }
    return (
        structure(f"DensityData_{precision.name}", data),
        structure(f"DensitySums_{precision.name}", sums),
    )


@functools.cache
def gather_kernel(precision: Precision, compensated: bool, walled: bool) -> wp.Kernel:
    """Kernel: positions and ways into slot order; ``back`` of the way is not gone yet."""
    real, seen = precision.scalar, seen_function(precision, compensated)
    Bodies, (Data, _), vec3 = bodies_type(precision), density_types(precision), precision.vec3

    @register
    def gather_fluid(
        first: int, pairs: Pairs, b: Bodies, dt: real, follow: real, back: real, d_out: Data
    ):
        s = first + wp.tid()
        i = pairs.order[s]
        way = b.v[i] * dt + b.correction[i] * follow
        d_out.x[s] = seen(s, i, pairs, b) - way * back
        d_out.way[s] = way
        d_out.free[s] = wp.where(b.w[i] > real(0.0), real(1.0), real(0.0))
        if wp.static(walled):
            d_out.open[s] = real(1.0)
            d_out.lean[s] = vec3()

    return gather_fluid


@functools.cache
def slack_kernels(precision: Precision) -> tuple[wp.Kernel, wp.Kernel]:
    """Kernels: the slack that forgives the density of a start, of marked worlds; and what begins
    with a substep: slack runs out, multipliers and the virial are 0.

    Slack is a length, h / 3 times the error: by how much a particle would part from its neighbours.
    """
    real, Easing = precision.scalar, easing_type(precision)
    ease, (_, Sums) = ease_function(precision), density_types(precision)

    @register
    def forgive_density(
        first: int, pairs: Pairs, marked: wp.array(dtype=wp.int32), h: wp.array(dtype=real), o: Sums
    ):
        s = first + wp.tid()
        world = pairs.world[s]
        if marked[world] != 0:
            o.slack[pairs.order[s]] = wp.max(o.error[s], real(0.0)) * h[world] / real(BEND)

    @register
    def begin_density(
        first: int, pairs: Pairs, h: wp.array(dtype=real), easing: Easing, dt: real,
        slack_io: wp.array(dtype=real), lam_out: wp.array(dtype=real),
        virial_out: wp.array(dtype=wp.float64),
    ):  # fmt: skip
        s = first + wp.tid()
        i = pairs.order[s]
        lam_out[i] = real(0.0)
        virial_out[i] = wp.float64(0.0)
        if slack_io[i] > real(0.0):
            slack_io[i] = ease(slack_io[i], h[pairs.world[s]], dt, easing)

    return forgive_density, begin_density


def _steep_function(slope: wp.Function, precision: Precision, params: Any) -> wp.Function:
    """``steep(r2, p)``: G = -dw/dq; of what coincides as if it were h apart."""
    real = precision.scalar

    def steep(r2: real, p: params):
        near = r2 <= p.closest_squared
        q = wp.where(near, real(1.0), wp.sqrt(r2) * p.inverse_h)
        return wp.max(-slope(q) * q, real(0.0))

    return function(steep)


def crowding_term(
    weight: wp.Function, slope: wp.Function, precision: Precision, params: Any
) -> Term:
    """Term (b_j w, b_j G n, G n n^T): density, its gradient, and who else's reaches the particle.

    n is the direction that the pair is pushed along.
    """
    vec3, real, ten = precision.vec3, precision.scalar, precision.vector(10)
    (Data, _), number = density_types(precision), reader(precision)
    steep, along = _steep_function(slope, precision, params), _along_function(precision, params)

    def crowd(i: int, j: int, x_ij: vec3, r2: real, d: Data, p: params):
        n = along(i, j, x_ij, r2, d, p)
        G = steep(r2, p)
        b = number(d.b, j)
        g = n * (b * G)
        t = n * (G * number(d.free, j))
        return ten(
            b * weight(wp.sqrt(r2) * p.inverse_h), g[0], g[1], g[2],
            t[0] * n[0], t[0] * n[1], t[0] * n[2], t[1] * n[1], t[1] * n[2], t[2] * n[2],
        )  # fmt: skip

    return Term(function(crowd), 10, rounding=None, placed=False)


def _along_function(precision: Precision, params: Any) -> wp.Function:
    """``along(i, j, x_ij, r2, d, p)``: the unit vector from j to i where the substep began.

    Pushes along it keep angular momentum exactly (see :mod:`..correction`). Where a pair has turned
    too far since, it is that of now.
    """
    vec3, real = precision.vec3, precision.scalar
    (Data, _), apart = density_types(precision), apart_function(precision)
    vector = reader(precision, 3)

    def along(i: int, j: int, x_ij: vec3, r2: real, d: Data, p: params):
        x, x2 = apart(d.slot[i], d.slot[j], x_ij, r2, p.closest_squared)
        y = x_ij - (vector(d.way, i) - vector(d.way, j))
        y2 = wp.dot(y, y)
        turned = wp.dot(y, x)
        straight = turned > real(STRAIGHT) * wp.sqrt(x2) * wp.sqrt(y2)
        began = wp.where(straight, real(1.0), real(0.0))
        n = y * began + x * (real(1.0) - began)
        return n / wp.sqrt(wp.where(straight, y2, x2))

    return function(along)


def share_term(slope: wp.Function, precision: Precision, params: Any) -> Term:
    """Term w_j e_j b_j G: what D_i has of a neighbour."""
    vec3, real, one = precision.vec3, precision.scalar, precision.vector(1)
    (Data, _), number = density_types(precision), reader(precision)
    steep = _steep_function(slope, precision, params)

    def share(i: int, j: int, x_ij: vec3, r2: real, d: Data, p: params):
        return one(number(d.share, j) * steep(r2, p))

    return Term(function(share), 1, rounding=None, placed=False)


def push_term(slope: wp.Function, precision: Precision, params: Any) -> Term:
    """Term (b_j dlam_i + b_i dlam_j) G n h, and it along the distance: the same both ways."""
    vec3, real, four = precision.vec3, precision.scalar, precision.vector(4)
    (Data, _), number = density_types(precision), reader(precision)
    steep, along = _steep_function(slope, precision, params), _along_function(precision, params)

    def push(i: int, j: int, x_ij: vec3, r2: real, d: Data, p: params):
        both = number(d.b, j) * number(d.push, i) + number(d.b, i) * number(d.push, j)
        f = along(i, j, x_ij, r2, d, p) * (both * steep(r2, p) * p.h)
        return four(f[0], f[1], f[2], wp.dot(f, x_ij))

    return Term(function(push), 4, rounding=None, placed=False)


def store_crowding(
    weight: wp.Function, walled: bool, precision: Precision, params: Any
) -> wp.Function:
    """Store: C_i, the particle's own part of D_i, and how it is split."""
    real, vec3 = precision.scalar, precision.vec3
    six, ten = precision.vector(6), precision.vector(10)
    Data, Sums = density_types(precision)
    eigenvalue = largest_eigenvalue(precision)

    def keep_crowding(i: int, particle: int, t: ten, d: Data, p: params, o: Sums):
        b = d.b[i]
        forgiven = o.eased * o.slack[particle] * (real(BEND) * p.inverse_h)
        room = real(1.0) + forgiven
        g = vec3(t[1], t[2], t[3])
        if wp.static(walled):
            room = d.open[i] + forgiven
            g = g + d.lean[i]
        o.error[i] = t[0] + b * weight(real(0.0)) - room
        g = g * d.free[i]
        steep = wp.length(g)
        per = real(1.0) / wp.where(steep > real(0.0), steep, real(1.0))
        crowding = six(
            b * t[4] + g[0] * g[0] * per, b * t[5] + g[0] * g[1] * per,
            b * t[6] + g[0] * g[2] * per, b * t[7] + g[1] * g[1] * per,
            b * t[8] + g[1] * g[2] * per, b * t[9] + g[2] * g[2] * per,
        )  # fmt: skip
        w = o.w[particle] * o.unit * eigenvalue(crowding)
        o.share[i] = w * b
        o.own[i] = w * steep
        o.steep[i] = crowding[0] + crowding[3] + crowding[5]

    return function(keep_crowding)


def store_multiplier(precision: Precision, params: Any) -> wp.Function:
    """Store: dlam_i = (C_i - alpha~ lam_i) / (D_i + alpha~), and lam_i >= 0.

    Where gradients are so small that more than a part of h would be gone, C counts as no more than
    what gradients of that size take back on such a way; and where a start has been forgiven more
    than little, on the way of its own speed.
    """
    real, one = precision.scalar, precision.vector(1)
    Data, Sums = density_types(precision)

    def multiply(i: int, particle: int, total: one, d: Data, p: params, o: Sums):
        D = total[0] + o.own[i]
        alpha = p.compliance * o.inverse_dt * o.unit * o.inverse_dt
        alpha = alpha * p.h * p.h
        lam = o.lam[particle]
        pace = wp.min(o.pace * p.inverse_h + o.pace_in_h, real(FARTHEST))
        forgiven = o.eased * o.slack[particle] * p.inverse_h > real(SMALLEST)
        most = wp.where(forgiven, pace, real(FARTHEST)) * o.steep[i]
        missing = wp.min(o.error[i], most) - alpha * lam
        active = d.free[i] * D > real(0.0)
        grown = o.relaxation * missing / wp.where(active, D + alpha, real(1.0))
        new = wp.where(active, wp.max(lam + grown, real(0.0)), lam)
        o.push[i] = new - lam
        o.lam[particle] = new

    return function(multiply)


def store_correction(
    walled: bool, precision: Precision, params: Any, compensated: bool
) -> wp.Function:
    """Store: x += w sum, and the same into the correction; the virial of the multipliers."""
    vec3, four = precision.vec3, precision.vector(4)
    (Data, _), Bodies = density_types(precision), bodies_type(precision)
    kept, place = rounding_function(precision, compensated), place_function(precision, compensated)

    def correct(i: int, particle: int, total: four, d: Data, p: params, o: Bodies):
        pushed = vec3(total[0], total[1], total[2])
        if wp.static(walled):
            pushed = pushed + d.lean[i] * (d.push[i] * p.h)
        dx = pushed * (o.w[particle] * o.unit)
        place(particle, o.x[particle], kept(particle, o), dx, o)
        rate = wp.float64(d.inverse_dt)
        w = wp.float64(total[3]) * rate * rate * wp.float64(d.unit)
        d.virial[particle] = d.virial[particle] + w

    return function(correct)
