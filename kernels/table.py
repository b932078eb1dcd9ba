"""Cubic splines as functions that laws call, and that ``wp.grad`` derives."""

from typing import Any

import numpy as np
import warp as wp

from .precision import Precision, native

_FIND = """
    {c} s = (x - ({c}){first!r}) * ({c}){inverse!r};
    // What is no number is taken for the first.
    {c} inside = s > ({c})0 ? s : ({c})0;
    inside = inside < ({c}){last} ? inside : ({c}){last};
    int k = (int)inside;
    k = k < {last} ? k : {last} - 1;
    const {c} t = inside - ({c})k;
    const {c} *at = cubics + 4 * k;
    const {c} slope = at[1] + t * (({c})2 * at[2] + t * ({c})3 * at[3]);
"""


def table_function(
    precision: Precision, first: float, spacing: float, cubics: np.ndarray
) -> wp.Function:
    """``table(x)``: the cubic that x is in, and beyond the ends straight on.

    Args:
        precision: Of the numbers.
        first: Where the first cubic begins.
        spacing: From one to the next.
        cubics: a, b, c, d of a + b t + c t^2 + d t^3, t from 0 to 1, (n, 4).
    """
    c, real = precision.c, precision.scalar
    numbers = ", ".join(repr(float(precision.numpy(each))) for each in cubics.ravel())
    fields: dict[str, Any] = {"c": c, "first": first, "inverse": 1.0 / spacing, "last": len(cubics)}
    held = f"    static const {c} cubics[] = {{{numbers}}};\n"
    find = held + _FIND.format(**fields)
    value = "at[0] + t * (at[1] + t * (at[2] + t * at[3])) + (s - inside) * slope"

    def table(x: real) -> real: ...

    return native(
        table, f"{find}    return {value};\n", after_gradients=False,
        adjoint=f"{find}    adj_x += slope * ({c}){1.0 / spacing!r} * adj_ret;\n",
    )  # fmt: skip
