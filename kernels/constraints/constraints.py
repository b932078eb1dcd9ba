"""XPBD on given tuples of particles: one Newton step of C(x) = 0 a tuple, colour by colour.

An *evaluation* is a Warp function ``evaluate(X, q) -> (C, G)``: the constraint and its gradient at
the positions ``X`` (k rows) with the tuple's parameters ``q``. It is derived from a law by
``wp.grad`` or written by hand.
"""

import functools
from dataclasses import dataclass
from typing import Any

import warp as wp

from ..engine.integrate import compensated_sum
from ..engine.loops import Periodicity, box_type, minimum_image
from ..precision import APART, Precision, function, function_from_source, register, structure


@dataclass(frozen=True)
class Solved:
    """What kernels that solve or measure tuples are made for."""

    evaluate: wp.Function
    precision: Precision
    periodic: Periodicity
    compensated: bool
    size: int  # particles of a tuple
    item: Any  # struct of a tuple's parameters
    relative: bool  # evaluated at positions seen from the tuple's first particle
    unit: bool  # the gradients have unit length

    @property
    def types(self) -> tuple[Any, Any, Any, Any]:
        """Scalar, box, tuples and bodies, which their kernels take."""
        precision = self.precision
        return (
            precision.scalar, box_type(precision), tuples_type(precision, self.size, self.item),
            bodies_type(precision),
        )  # fmt: skip


def bodies_type(precision: Precision) -> Any:
    """The arrays of the state that constraints read and correct.

    Multipliers are in ``unit``s of mass and times w times ``unit``: their product with a length
    would leave single precision in planets' or electrons' units.
    """
    vec3, real = precision.vec3, precision.scalar
    fields = {
        "x": wp.array(dtype=vec3),
        "x_error": wp.array(dtype=vec3),  # of compensated sums, else empty
        "v": wp.array(dtype=vec3),
        "w": wp.array(dtype=real),
        "correction": wp.array(dtype=vec3),
        "unit": real,  # of mass, a power of two
        "most": real,  # C / |grad C|^2 beyond it, or NaN, comes of a gradient that does not exist
    }
    return structure(f"Bodies_{precision.name}", fields)


def tuples_type(precision: Precision, size: int, item: Any) -> Any:
    """Tuples of ``size`` particles, sorted by colour."""
    fields = {
        "particle": wp.array(dtype=wp.types.vector(length=size, dtype=wp.int32)),
        "world": wp.array(dtype=wp.int32),
        "item": wp.array(dtype=item),
        "lam": wp.array(dtype=precision.scalar),
        "broken": wp.array(dtype=wp.int32),  # empty where nothing can break
        "one_sided": wp.int32,
        "breakable": wp.int32,
    }
    return structure(f"Tuples{size}_{precision.name}", fields)


def positions_type(precision: Precision, size: int) -> Any:
    """One row for each particle of a tuple."""
    return wp.types.matrix(shape=(size, 3), dtype=precision.scalar)


def rounding_function(precision: Precision, compensated: bool) -> wp.Function:
    """``kept(i, b)``: what rounding has kept from the position of particle i."""
    vec3, Bodies = precision.vec3, bodies_type(precision)

    def kept(i: int, b: Bodies):
        if wp.static(compensated):
            return b.x_error[i]
        else:
            return vec3()

    return function(kept)


def place_function(precision: Precision, compensated: bool) -> wp.Function:
    """``place(i, x, e, dx, b)``: particle i goes from x, with rounding error e, on by dx."""
    vec3, Bodies, add = precision.vec3, bodies_type(precision), compensated_sum(precision)

    def place(i: int, x: vec3, e: vec3, dx: vec3, b: Bodies):
        if wp.static(compensated):
            total, error = add(x, dx, e)
            b.x_error[i] = error
            b.x[i] = total
        else:
            b.x[i] = x + dx
        b.correction[i] = b.correction[i] + dx

    return function(place)


def derived_evaluation(
    law: wp.Function, size: int, arguments: tuple[str, ...], precision: Precision, item: Any
) -> wp.Function:
    """Evaluation of a law C(x_0, ..., x_(k-1), ...) with its gradient by ``wp.grad``."""
    call = ", ".join([f"X[{a}]" for a in range(size)] + [f"q.{name}" for name in arguments])
    gradient = [f"g{a}" for a in range(size)]
    derivatives = ", ".join(gradient + [f"unused{n}" for n in range(len(arguments))])
    source = (
        "def derived_constraint(X: Positions, q: Item):\n"
        f"    {derivatives} = wp.grad(law)({call})\n"
        f"    return law({call}), wp.matrix_from_rows({', '.join(gradient)})\n"
    )
    namespace = {"wp": wp, "law": law, "Positions": positions_type(precision, size), "Item": item}
    return function_from_source(source, namespace)


def distance_evaluation(sign: int, precision: Precision, item: Any) -> wp.Function:
    """C = sign (|x_1 - x_0| - L). Coincident ends get a fixed direction and so part again."""
    real, positions = precision.scalar, positions_type(precision, 2)
    apart = precision.vec3(*APART)

    def distance_constraint(X: positions, q: item):
        d = X[1] - X[0]
        r = wp.length(d)
        n = apart
        if r > real(0.0):
            n = d * (real(1.0) / r)
        if wp.static(sign < 0):
            return q.rest_length - r, wp.matrix_from_rows(n, -n)
        else:
            return r - q.rest_length, wp.matrix_from_rows(-n, n)

    return function(distance_constraint)


@functools.cache
def view_function(law: Solved) -> wp.Function:
    """``view(r, box, t, b) -> (x, e, X, C, G)``: tuple r as it is now.

    Its positions, what rounding has kept from them, what the evaluation sees of both, in one piece
    of a periodic box, each the image next to the one before it, and what it makes of it. Seen from
    the first particle, together with what rounding has kept, a distance is far from the origin as
    exact as near to it.
    """
    _real, Box, Tuples, Bodies = law.types
    evaluate, size, relative, compensated = law.evaluate, law.size, law.relative, law.compensated
    positions, wraps = positions_type(law.precision, size), bool(law.periodic)
    vec3, image = law.precision.vec3, minimum_image(law.precision, law.periodic)

    def view(r: int, box: wp.array(dtype=Box), t: Tuples, b: Bodies):
        ids = t.particle[r]
        x = positions()
        e = positions()
        for a in range(wp.static(size)):
            x[a] = b.x[ids[a]]
            if wp.static(compensated):
                e[a] = b.x_error[ids[a]]
        X = x
        if wp.static(relative or wraps):
            if wp.static(relative):
                X[0] = vec3()
            for a in range(1, wp.static(size)):
                d = x[a] - x[a - 1]
                if wp.static(wraps):
                    d = image(d, box[t.world[r]])
                if wp.static(relative and compensated):
                    d = d + (e[a] - e[a - 1])
                X[a] = X[a - 1] + d
        C, G = evaluate(X, t.item[r])
        return x, e, X, C, G

    # Emitted behind the evaluation, which may itself stand behind the adjoints that it calls.
    return function(view, after_gradients=True)


@functools.cache
def project_kernel(law: Solved) -> wp.Kernel:
    """Kernel: one sweep over the tuples of a colour (Macklin et al. 2016, eqs. 17, 18 and 26).

    dlam = (-C - alpha~ lam - gamma grad C . (x - x_prev)) / ((1 + gamma) sum w |grad C|^2 + alpha~)
    with alpha~ = alpha / dt^2 and gamma = alpha beta / dt; then dx_a = w_a grad_a C dlam. The way
    of this substep, x - x_prev, is v dt plus the corrections so far, which does not cancel.
    """
    real, Box, Tuples, Bodies = law.types
    size, unit, weights = law.size, law.unit, law.precision.vector(law.size)
    view, place = view_function(law), place_function(law.precision, law.compensated)

    @register
    def project_tuples(
        first: int,
        start: int,
        box: wp.array(dtype=Box),
        t: Tuples,
        b: Bodies,
        dt: real,
        inverse_dt: real,
    ):
        r = start + first + wp.tid()
        if t.breakable != 0:
            if t.broken[r] != 0:
                return
        ids = t.particle[r]
        q = t.item[r]
        x, e, _X, C, G = view(r, box, t, b)
        w = weights()
        s = real(0.0)
        total = real(0.0)
        for a in range(wp.static(size)):
            w[a] = b.w[ids[a]] * b.unit
            total += w[a]
            if wp.static(unit):
                s += w[a]
            else:
                s += w[a] * wp.length_sq(G[a])
        lam = t.lam[r]
        alpha = q.compliance * inverse_dt * b.unit * inverse_dt  # in an order that stays in range
        gamma = q.compliance * q.damping * inverse_dt
        way = real(0.0)
        if gamma > real(0.0):
            for a in range(wp.static(size)):
                way += wp.dot(G[a], b.v[ids[a]] * dt + b.correction[ids[a]])
        new = lam + (-C - alpha * lam - gamma * way) / ((real(1.0) + gamma) * s + alpha)
        if t.one_sided != 0:
            new = wp.max(new, real(0.0))
            if C >= real(0.0) and lam == real(0.0):
                new = real(0.0)
        d_lam = new - lam
        # All pinned, or no gradient (a comparison with NaN is false): nothing sensible to do.
        if s > real(0.0) and wp.abs(d_lam) * total < b.most:
            t.lam[r] = new
            for a in range(wp.static(size)):
                place(ids[a], x[a], e[a], G[a] * (w[a] * d_lam), b)

    return project_tuples


@functools.cache
def reset_kernel(precision: Precision) -> wp.Kernel:
    """Kernel: multipliers to zero as a substep starts, and its time scale kept for reports."""
    real = precision.scalar

    @register
    def reset_multipliers(
        first: int,
        inverse_dt: wp.float64,
        lam_out: wp.array(dtype=real),
        scale_out: wp.array(dtype=wp.float64),
    ):
        r = first + wp.tid()
        lam_out[r] = real(0.0)
        if r == 0:
            scale_out[0] = inverse_dt * inverse_dt

    return reset_multipliers


@functools.cache
def strain_kernel(law: Solved) -> wp.Kernel:
    """Kernel: force of each tuple, |lam| max_a |grad_a C| / dt^2; what exceeds its limit breaks."""
    real, Box, Tuples, Bodies = law.types
    size, view = law.size, view_function(law)

    @register
    def strain_tuples(
        first: int,
        may_break: int,
        box: wp.array(dtype=Box),
        t: Tuples,
        b: Bodies,
        scale: wp.array(dtype=wp.float64),
        force_out: wp.array(dtype=real),
    ):
        r = first + wp.tid()
        _x, _e, _X, _C, G = view(r, box, t, b)
        steepest = real(0.0)
        for a in range(wp.static(size)):
            steepest = wp.max(steepest, wp.length(G[a]))
        force = real(wp.float64(wp.abs(t.lam[r]) * steepest) * scale[0] * wp.float64(b.unit))
        force_out[r] = force
        if may_break != 0 and force > t.item[r].break_force:
            t.broken[r] = 1

    return strain_tuples
