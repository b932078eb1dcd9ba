"""Kicks and drifts in C++, number by number, for the vector units of a CPU.

The same operations in the same order as :func:`~particlesim.kernels.engine.integrate.plain_rows`,
to the last bit; what leaves a periodic box is left to it.
"""

import functools
from types import SimpleNamespace

import warp as wp

from ..precision import Precision, function, native
from ..warp_internals import elements, native_name
from .integrate import compensated_sum, motion_functions, motion_type, wrap_function
from .loops import Periodicity

BLOCK = 64  # rows that a thread of the CPU takes


def _kick(precision: Precision, forces: bool, compensated: bool) -> tuple[str, str]:
    """C++: w dt for each number of the rows, and the kick of number k, whose velocity is ``v``."""
    c = precision.c
    if not forces:
        return "", f"const {c} v = {elements('m.v', c)}[k];"
    before = f"""
    {c} scale[{3 * BLOCK}];
    for (int l = 0; l < last - first; ++l) {{
        const {c} s = {elements("m.w", c)}[first + l] * dt;
        scale[3 * l] = s; scale[3 * l + 1] = s; scale[3 * l + 2] = s;
    }}
"""
    dv = f"{elements('m.f', c)}[k] * scale[k - begin]"
    return before, f"{_added(precision, compensated, 'v', dv)} const {c} v = v_sum;"


def _added(precision: Precision, compensated: bool, name: str, step: str) -> str:
    """C++: number k of an array, and of its error, on by a step; the sum stays at hand."""
    c, array, error = precision.c, elements(f"m.{name}", precision.c), f"m.{name}_error"
    if not compensated:
        return f"const {c} {name}_sum = {array}[k] + {step}; {array}[k] = {name}_sum;"
    add = native_name(compensated_sum(precision.scalar))
    errors = elements(error, c)
    return (
        f"{c} {name}_sum, {name}_rest; {add}({array}[k], {step}, {errors}[k], {name}_sum, "
        f"{name}_rest); {array}[k] = {name}_sum; {errors}[k] = {name}_rest;"
    )


def _loop(before: str, body: str) -> str:
    """C++: over the numbers of the rows from first to last. No two arrays share memory.

    Products are rounded before they are added, as they are in Warp's own functions.
    """
    return f"""{before}
    const long long begin = 3 * (long long)first, end = 3 * (long long)last;
#pragma clang loop vectorize(assume_safety)
    for (long long k = begin; k < end; ++k) {{
#pragma clang fp contract(off)
        {body}
    }}
"""


def _leave_function(precision: Precision, periodic: Periodicity) -> wp.Function:
    """``leave(first, last, m)``: 0 where none of the rows has left its periodic box, as ``wrap``
    sees it.
    """
    Motion, c = motion_type(precision), precision.c
    tests = " ".join(
        f"""{{
            const {c} p = x[3 * (long long)i + {a}], t = (p - b.lower[{a}]) * b.inverse[{a}];
            out |= !((t >= 0) & (t < 1)) | (p < b.lower[{a}]) | (p >= b.lower[{a}] + b.length[{a}]);
        }}"""
        for a, on in enumerate(periodic)
        if on
    )
    snippet = f"""
    const {c}* x = {elements("m.x", c)};
    const int* world = {elements("m.world", "int")};
    int out = 0;
    auto look = [&](int i, const auto& b) {{ {tests} }};
    if (world[first] == world[last - 1]) {{  // as mostly: one box for all of them
        const auto b = m.box.data[world[first]];
        for (int i = first; i < last; ++i) look(i, b);
    }} else {{
        for (int i = first; i < last; ++i) look(i, m.box.data[world[i]]);
    }}
    return out;
"""

    def leave(first: int, last: int, m: Motion) -> int: ...

    return native(leave, snippet, after_gradients=False)


@functools.cache
def native_rows(
    precision: Precision, periodic: Periodicity, forces: bool, compensated: bool,
    constrained: bool, remember: bool,
) -> SimpleNamespace:  # fmt: skip
    """What ``plain_rows`` makes, for at most ``BLOCK`` rows."""
    real, Motion, c = precision.scalar, motion_type(precision), precision.c
    add, zero = compensated_sum(real), real(0.0)
    before, kick = _kick(precision, forces, compensated)
    v, x = elements("m.v", c), elements("m.x", c)
    correction = elements("m.correction", c)
    kept = f"{elements('m.x_previous', c)}[k] = {x}[k];" if remember else ""
    reset = f"{correction}[k] = 0;" if constrained else ""
    drift = _added(precision, compensated, "x", "v * dt_drift")

    def advance_natively(first: int, last: int, dt: real, dt_drift: real, m: Motion):
        add(zero, zero, zero)

    def kick_natively(first: int, last: int, dt: real, m: Motion):
        add(zero, zero, zero)

    def follow_natively(first: int, last: int, inverse_dt: real, m: Motion): ...

    advanced = native(advance_natively, _loop(before, kept + kick + drift + reset), False)
    kicked = native(kick_natively, _loop(before, kick), False)
    followed = native(
        follow_natively, _loop("", f"{v}[k] = {v}[k] + {correction}[k] * inverse_dt;"), False
    )
    if not periodic:
        return SimpleNamespace(advance=advanced, kick=kicked, follow=followed)
    leave = _leave_function(precision, periodic)
    _, move = motion_functions(precision, forces, compensated)
    wrap = wrap_function(move, precision, compensated, remember)

    def advance_in_box(first: int, last: int, dt: real, dt_drift: real, m: Motion):
        advanced(first, last, dt, dt_drift, m)
        if leave(first, last, m) != 0:
            for i in range(first, last):
                wrap(i, m)

    def follow_in_box(first: int, last: int, inverse_dt: real, m: Motion):
        followed(first, last, inverse_dt, m)
        if leave(first, last, m) != 0:
            for i in range(first, last):
                wrap(i, m)

    return SimpleNamespace(
        advance=function(advance_in_box), kick=kicked, follow=function(follow_in_box)
    )
