"""XPBD: what a law makes of one tuple, and the multiplier that follows."""

import functools

import warp as wp

from ..precision import Precision, function
from .constraints import Solved, bodies_type, positions_type, seen_function

TURNED = 0.5  # of the gradient: what is left of it along that at the start of the substep
SHIFTED = 0.5  # parts of a tuple's extent that it may shift its particles by, in a substep


@functools.cache
def load_function(law: Solved) -> wp.Function:
    """``load(ids, b) -> (x, e, c, v, w)``: what the state has of a tuple's particles."""
    size, compensated, Bodies = law.size, law.compensated, bodies_type(law.precision)
    positions, weights = positions_type(law.precision, size), law.precision.vector(size)
    indices = wp.types.vector(length=size, dtype=wp.int32)

    def load(ids: indices, b: Bodies):
        x = positions()
        e = positions()
        c = positions()
        v = positions()
        w = weights()
        for a in range(wp.static(size)):
            x[a] = b.x[ids[a]]
            w[a] = b.w[ids[a]]
            c[a] = b.correction[ids[a]]
            v[a] = b.v[ids[a]]
            if wp.static(compensated):
                e[a] = b.x_error[ids[a]]
        return x, e, c, v, w

    return function(load)


@functools.cache
def carry_function(precision: Precision) -> wp.Function:
    """``carry(X, Y, G) -> H``: a gradient of four particles at X, carried to where they were at Y.

    H_a = F G_a of the linear map F that takes the edges of X to those of Y. With G_a = E S b_a, E
    the edges of X and S symmetric, as of any C that turning does not change, H_a = F E S b_a has no
    moment at Y either.
    """
    real, positions = precision.scalar, positions_type(precision, 4)

    def carry(X: positions, Y: positions, G: positions):
        u, v, w = X[1] - X[0], X[2] - X[0], X[3] - X[0]
        vw, wu, uv = wp.cross(v, w), wp.cross(w, u), wp.cross(u, v)
        share = real(1.0) / wp.dot(u, vw)
        H = positions()
        for a in range(4):
            g = G[a] * share
            H[a] = (
                (Y[1] - Y[0]) * wp.dot(vw, g)
                + (Y[2] - Y[0]) * wp.dot(wu, g)
                + (Y[3] - Y[0]) * wp.dot(uv, g)
            )
        return H

    return function(carry)


@functools.cache
def alike_function(precision: Precision) -> wp.Function:
    """``alike(H, K, G) -> H``, or K where H is not about G; number by number.

    That at the start, which stays as it is in all sweeps of a substep, is the better one.
    """
    real, positions = precision.scalar, positions_type(precision, 4)

    def alike(H: positions, K: positions, G: positions):
        own = real(0.0)
        other = real(0.0)
        both = real(0.0)
        for a in range(4):
            own += wp.length_sq(G[a])
            other += wp.length_sq(H[a])
            both += wp.dot(G[a], H[a])
        about = wp.where(both >= real(0.9) * own, other <= real(1.25) * own, False)
        D = positions()
        for a in range(4):
            for k in range(3):
                D[a, k] = wp.where(about, H[a, k], K[a, k])
        return D

    return function(alike)


@functools.cache
def evaluate_function(law: Solved) -> wp.Function:
    """``evaluate(x, e, c, v, q, B, dt) -> (C, G, H, extent)``: what a law makes of a tuple.

    C and its gradient where the particles are, the gradient where the substep began, and how far
    the particles were apart there. The way of the substep is v dt plus the corrections so far,
    which does not cancel. A projection outside of time (dt = 0) begins where it is.
    """
    positions, Box, item = positions_type(law.precision, law.size), law.types[1], law.item
    law_of, seen, real = law.evaluate, seen_function(law), law.precision.scalar
    size, relative, carried = law.size, law.relative, law.carried
    carry, alike = carry_function(law.precision), alike_function(law.precision)

    def evaluate_seen(
        x: positions, e: positions, c: positions, v: positions, q: item, B: Box, dt: real
    ):
        X = seen(x, e, B)
        C, G = law_of(X, q)
        H = G
        extent = real(0.0)
        if wp.static(size > 1):
            began = wp.where(dt > real(0.0), real(1.0), real(0.0))
            Y = X
            for a in range(wp.static(size)):
                Y[a] = X[a] - (v[a] * dt + c[a]) * began
            if wp.static(relative):
                first = Y[0]
                for a in range(wp.static(size)):
                    Y[a] = Y[a] - first
            _C, H = law_of(Y, q)
            if wp.static(carried):
                H = alike(H, carry(X, Y, G), G)
            for a in range(1, wp.static(size)):
                extent += wp.length_sq(Y[a] - Y[0])
            extent = wp.sqrt(extent)
        return C, G, H, extent

    # Emitted behind the evaluation, which may itself stand behind the adjoints that it calls.
    return function(evaluate_seen, after_gradients=True)


def _sums_function(law: Solved) -> wp.Function:
    """``sums(G, H, w) -> (s, turned, began, reach, total)``: what all particles of a tuple add to.

    s, turned and began are w G . G, w G . H and w H . H; reach w |G|; total w.
    """
    real, size, unit = law.precision.scalar, law.size, law.unit
    positions, weights = positions_type(law.precision, law.size), law.precision.vector(law.size)

    def sums(G: positions, H: positions, w: weights):
        s = real(0.0)
        turned = real(0.0)
        began = real(0.0)
        reach = real(0.0)
        total = real(0.0)
        for a in range(wp.static(size)):
            total += w[a]
            turned += w[a] * wp.dot(G[a], H[a])
            if wp.static(not unit):
                s += w[a] * wp.length_sq(G[a])
                began += w[a] * wp.length_sq(H[a])
                reach += w[a] * wp.length(G[a])
        if wp.static(unit):
            return total, turned, total, total, total
        else:
            return s, turned, began, reach, total

    return function(sums)


@functools.cache
def multiply_function(law: Solved) -> wp.Function:
    """``multiply(...) -> (lam, good, dx)``: a tuple's multiplier after one step, whether it makes
    sense, and how far each particle goes.

        dlam = (-C - alpha~ lam) / (sum w grad C . D + alpha~),  dx_a = w_a D_a dlam

    with alpha~ = alpha / dt^2 (Macklin et al. 2016, eqs. 17 and 18) and D the gradient H at the
    start of the substep (Ryckaert, Ciccotti and Berendsen 1977, eq. 4.8): the impulses D dlam / dt
    act where the particles were, so that the angular momentum sum m x_new x (x_new - x_old) / dt =
    sum m x_old x v is kept exactly. Where the tuple has turned too far for that, or pulls so hard
    that a substep does not resolve how it swings (it shifts its particles by more than a part of
    its extent), D is the gradient G where they are now, which is stable at any step.

    It chooses among numbers and does not branch, so that many tuples can be taken at once.
    """
    real = law.precision.scalar
    positions, weights = positions_type(law.precision, law.size), law.precision.vector(law.size)
    size, item, one_sided, sums = law.size, law.item, law.one_sided, _sums_function(law)

    def multiply(
        C: real, G: positions, H: positions, extent: real, w: weights, lam: real, q: item,
        mass: real, most: real, inverse_dt: real,
    ):  # fmt: skip
        for a in range(wp.static(size)):
            w[a] = w[a] * mass
        s, turned, began, reach, total = sums(G, H, w)
        alpha = q.compliance * inverse_dt * mass * inverse_dt  # in an order that stays in range
        missing = -C - alpha * lam
        shift = reach * wp.abs(lam + missing / (s + alpha))
        straight = wp.where(
            turned >= real(TURNED) * s,
            wp.where(began * real(TURNED) <= s, shift <= real(SHIFTED) * extent, False),
            False,
        )
        if wp.static(size > 1):
            s = wp.where(straight, turned, s)
        new = lam + missing / (s + alpha)
        if wp.static(one_sided):
            new = wp.max(new, real(0.0))
            new = wp.where(C >= real(0.0), wp.where(lam == real(0.0), real(0.0), new), new)
        d_lam = new - lam
        # All pinned, or no gradient (a comparison with NaN is false): nothing sensible to do.
        good = wp.where(s > real(0.0), wp.abs(d_lam) * total < most, False)
        dx = G
        for a in range(wp.static(size)):
            for k in range(3):
                along = G[a, k]
                if wp.static(size > 1):
                    along = wp.where(straight, H[a, k], G[a, k])
                dx[a, k] = along * (w[a] * d_lam)
        return new, good, dx

    return function(multiply)
