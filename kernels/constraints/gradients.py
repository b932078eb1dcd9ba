"""Constraints and their gradients at given positions, for checks."""

import functools
from typing import Any

import warp as wp

from ..precision import Precision, function, register
from .constraints import positions_type


def gradient_kernel(evaluate: wp.Function, precision: Precision, size: int, item: Any) -> wp.Kernel:
    """Kernel: C and its gradient at each row of positions, with the parameters of its tuple."""
    real, Positions = precision.scalar, positions_type(precision, size)

    def evaluated(X: Positions, q: item):
        C, G = evaluate(X, q)
        return C, G

    # Emitted behind the evaluation, which may itself stand behind the adjoints that it calls.
    at = function(evaluated, after_gradients=True)

    @functools.partial(register, cpu_only=True)  # asked for by hand
    def constraint_gradients(
        first: int,
        place: wp.array(dtype=Positions),
        owner: wp.array(dtype=wp.int32),
        q: wp.array(dtype=item),
        C_out: wp.array(dtype=real),
        G_out: wp.array(dtype=Positions),
    ):
        n = first + wp.tid()
        C, G = at(place[n], q[owner[n]])
        C_out[n] = C
        G_out[n] = G

    return constraint_gradients
