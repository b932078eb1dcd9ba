"""Given tuples of particles and the constraints on them: what kernels take, see and make of them.

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
    carried: bool  # where that at the start does not exist it is the present one, carried back
    # What some tuple of some world asks for; what none does is not compiled.
    damped: bool
    one_sided: bool
    breakable: bool

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
        "scale": wp.array(dtype=wp.float64),  # 1 / dt^2 of the substep that made them
        "broken": wp.array(dtype=wp.int32),  # empty where nothing can break
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


def shift_function(precision: Precision, compensated: bool) -> wp.Function:
    """``shift(x, e, c, dx) -> (x, e, c)``: x on by dx, its rounding error, all corrections."""
    vec3, add = precision.vec3, compensated_sum(precision.vec3)

    def shift(x: vec3, e: vec3, c: vec3, dx: vec3):
        total = x + dx
        error = e
        if wp.static(compensated):
            total, error = add(x, dx, e)
        return total, error, c + dx

    return function(shift)


def place_function(precision: Precision, compensated: bool) -> wp.Function:
    """``place(i, x, e, dx, b)``: particle i goes from x, with rounding error e, on by dx."""
    vec3, Bodies, shift = (
        precision.vec3,
        bodies_type(precision),
        shift_function(precision, compensated),
    )

    def place(i: int, x: vec3, e: vec3, dx: vec3, b: Bodies):
        total, error, correction = shift(x, e, b.correction[i], dx)
        b.x[i] = total
        b.correction[i] = correction
        if wp.static(compensated):
            b.x_error[i] = error

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
        inverse = real(1.0) / r
        n = apart
        for k in range(3):  # chosen number by number, see correct_function
            n[k] = wp.where(r > real(0.0), d[k] * inverse, apart[k])
        if wp.static(sign < 0):
            return q.rest_length - r, wp.matrix_from_rows(n, -n)
        else:
            return r - q.rest_length, wp.matrix_from_rows(-n, n)

    return function(distance_constraint)


def seen_function(law: Solved) -> wp.Function:
    """``seen(x, e, B) -> X``: what an evaluation sees of a tuple.

    Of its positions and what rounding has kept from them, in one piece of a periodic box, each the
    image next to the one before it. Seen from the first particle, together with what rounding has
    kept, a distance is far from the origin as exact as near to it.
    """
    size, relative, compensated = law.size, law.relative, law.compensated
    positions, wraps = positions_type(law.precision, size), bool(law.periodic)
    vec3, Box = law.precision.vec3, box_type(law.precision)
    image = minimum_image(law.precision, law.periodic)

    def seen(x: positions, e: positions, B: Box):
        X = x
        if wp.static(relative or wraps):
            if wp.static(relative):
                X[0] = vec3()
            for a in range(1, wp.static(size)):
                d = x[a] - x[a - 1]
                if wp.static(wraps):
                    d = image(d, B)
                if wp.static(relative and compensated):
                    d = d + (e[a] - e[a - 1])
                X[a] = X[a - 1] + d
        return X

    return function(seen)


@functools.cache
def view_function(law: Solved) -> wp.Function:
    """``view(r, box, t, b) -> (X, C, G)``: tuple r as an evaluation sees it now, and what it makes
    of it.
    """
    _real, Box, Tuples, Bodies = law.types
    positions, wraps = positions_type(law.precision, law.size), bool(law.periodic)
    evaluate, seen, size, compensated = law.evaluate, seen_function(law), law.size, law.compensated

    def view(r: int, box: wp.array(dtype=Box), t: Tuples, b: Bodies):
        ids = t.particle[r]
        x = positions()
        e = positions()
        for a in range(wp.static(size)):
            x[a] = b.x[ids[a]]
            if wp.static(compensated):
                e[a] = b.x_error[ids[a]]
        B = Box()
        if wp.static(wraps):
            B = box[t.world[r]]
        X = seen(x, e, B)
        C, G = evaluate(X, t.item[r])
        return X, C, G

    # Emitted behind the evaluation, which may itself stand behind the adjoints that it calls.
    return function(view, after_gradients=True)


@functools.cache
def strain_kernel(law: Solved) -> wp.Kernel:
    """Kernel: force of each tuple, |lam| max_a |grad_a C| / dt^2; what exceeds its limit breaks."""
    real, Box, Tuples, Bodies = law.types
    size, view, breakable = law.size, view_function(law), law.breakable

    @register
    def strain_tuples(
        first: int,
        may_break: int,
        box: wp.array(dtype=Box),
        t: Tuples,
        b: Bodies,
        force_out: wp.array(dtype=real),
    ):
        r = first + wp.tid()
        _X, _C, G = view(r, box, t, b)
        steepest = real(0.0)
        for a in range(wp.static(size)):
            steepest = wp.max(steepest, wp.length(G[a]))
        force = real(wp.float64(wp.abs(t.lam[r]) * steepest) * t.scale[0] * wp.float64(b.unit))
        force_out[r] = force
        if wp.static(breakable):
            if may_break != 0 and force > t.item[r].break_force:
                t.broken[r] = 1

    return strain_tuples
