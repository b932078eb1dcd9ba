"""XPBD: what a law makes of one tuple, and the multiplier that follows."""

import functools

import warp as wp

from ..precision import function
from .constraints import Solved, positions_type, seen_function


@functools.cache
def evaluate_function(law: Solved) -> wp.Function:
    """``evaluate(x, e, q, B) -> (C, G)``: what a law makes of what it sees of a tuple."""
    positions, Box, item = positions_type(law.precision, law.size), law.types[1], law.item
    law_of, seen = law.evaluate, seen_function(law)

    def evaluate_seen(x: positions, e: positions, q: item, B: Box):
        C, G = law_of(seen(x, e, B), q)
        return C, G

    # Emitted behind the evaluation, which may itself stand behind the adjoints that it calls.
    return function(evaluate_seen, after_gradients=True)


@functools.cache
def multiply_function(law: Solved) -> wp.Function:
    """``multiply(...) -> (lam, good, s)``: a tuple's multiplier after one step, whether it makes
    sense, and how far along grad_a C each particle goes (Macklin et al. 2016, eqs. 17, 18 and 26).

    dlam = (-C - alpha~ lam - gamma grad C . (x - x_prev)) / ((1 + gamma) sum w |grad C|^2 + alpha~)
    with alpha~ = alpha / dt^2 and gamma = alpha beta / dt; then dx_a = w_a grad_a C dlam. The way
    of this substep, x - x_prev, is v dt plus the corrections so far, which does not cancel.

    It chooses among numbers and does not branch, so that many tuples can be taken at once.
    """
    real = law.precision.scalar
    positions, weights = positions_type(law.precision, law.size), law.precision.vector(law.size)
    size, unit, item = law.size, law.unit, law.item
    damped, one_sided = law.damped, law.one_sided

    def multiply(
        C: real, G: positions, c: positions, v: positions, w: weights, lam: real, q: item,
        mass: real, most: real, dt: real, inverse_dt: real,
    ):  # fmt: skip
        s = real(0.0)
        total = real(0.0)
        for a in range(wp.static(size)):
            w[a] = w[a] * mass
            total += w[a]
            if wp.static(unit):
                s += w[a]
            else:
                s += w[a] * wp.length_sq(G[a])
        alpha = q.compliance * inverse_dt * mass * inverse_dt  # in an order that stays in range
        new = real(0.0)
        if wp.static(damped):
            gamma = q.compliance * q.damping * inverse_dt
            way = real(0.0)
            for a in range(wp.static(size)):
                way += wp.dot(G[a], v[a] * dt + c[a])
            # A world that is not damped goes as it goes alone.
            way = wp.where(gamma > real(0.0), gamma * way, real(0.0))
            new = lam + (-C - alpha * lam - way) / ((real(1.0) + gamma) * s + alpha)
        else:
            new = lam + (-C - alpha * lam) / (s + alpha)
        if wp.static(one_sided):
            new = wp.max(new, real(0.0))
            new = wp.where(C >= real(0.0), wp.where(lam == real(0.0), real(0.0), new), new)
        d_lam = new - lam
        # All pinned, or no gradient (a comparison with NaN is false): nothing sensible to do.
        good = wp.where(s > real(0.0), wp.abs(d_lam) * total < most, False)
        for a in range(wp.static(size)):
            w[a] = w[a] * d_lam
        return new, good, w

    return function(multiply)
