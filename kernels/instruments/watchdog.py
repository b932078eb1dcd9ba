"""The watchdog's look at all particles, once a frame, and what it needs when it has found some."""

import functools
from typing import Any

import warp as wp

from ..precision import Precision, function, native, register
from ..warp_internals import elements


def _plain(precision: Precision) -> wp.Function:
    """``outside(a, b, low, high, fast, quick, x, v)``: of the particles a to b - 1, 1 if one is not
    within the limits, plus 2 if one is quick.
    """
    vec3, real = precision.vec3, precision.scalar

    def outside(
        a: int, b: int, low: vec3, high: vec3, fast: real, quick: real, x: wp.array(dtype=vec3),
        v: wp.array(dtype=vec3),
    ):  # fmt: skip
        good = bool(True)
        slow = bool(True)
        for i in range(a, b):
            x_i = x[i]
            v_i = v[i]
            for k in range(3):
                good = good and x_i[k] >= low[k] and x_i[k] <= high[k] and wp.abs(v_i[k]) <= fast
                slow = slow and wp.abs(v_i[k]) <= quick
        return wp.where(good, 0, 1) + wp.where(slow, 0, 2)

    return function(outside)


def _vectorised(precision: Precision) -> wp.Function:
    """The same in C++ without a branch, for the CPU's vector units."""
    vec3, real, c = precision.vec3, precision.scalar, precision.c
    axes = "\n".join(
        f"        bad |= !(x_[3 * i + {k}] >= l{k}) | !(x_[3 * i + {k}] <= h{k}) | "
        f"!(v_[3 * i + {k}] <= fast) | !(v_[3 * i + {k}] >= -fast);\n"
        f"        hurried |= !(v_[3 * i + {k}] <= quick) | !(v_[3 * i + {k}] >= -quick);"
        for k in range(3)
    )
    snippet = f"""
    const {c}* x_ = {elements("x", c)};
    const {c}* v_ = {elements("v", c)};
    const {c} l0 = low[0], l1 = low[1], l2 = low[2], h0 = high[0], h1 = high[1], h2 = high[2];
    int bad = 0, hurried = 0;
#pragma clang loop vectorize(enable)
    for (int i = a; i < b; ++i) {{
{axes}
    }}
    return bad + 2 * hurried;
"""

    def outside(
        a: int, b: int, low: vec3, high: vec3, fast: real, quick: real, x: wp.array(dtype=vec3),
        v: wp.array(dtype=vec3),
    ) -> int: ...  # fmt: skip

    return native(outside, snippet, after_gradients=False)


@functools.cache
def check_kernel(precision: Precision, vectorised: bool) -> wp.Kernel:
    """Kernel: raise the first flag if a particle is not within the limits of its world.

    lower_a <= x_a <= upper_a and |v_a| <= speed on every axis a. The limits are finite, so that
    infinities fail them too, as NaN fails every comparison. The second flag: |v_a| > quick, which
    is nothing wrong. One thread looks at one block.
    """
    vec3, real = precision.vec3, precision.scalar
    outside = (_vectorised if vectorised else _plain)(precision)

    @functools.partial(register, cpu_only=vectorised)
    def check_limits(
        first: int,
        begin: wp.array(dtype=wp.int32),
        end: wp.array(dtype=wp.int32),
        world: wp.array(dtype=wp.int32),
        lower: wp.array(dtype=vec3),
        upper: wp.array(dtype=vec3),
        speed: wp.array(dtype=real),
        quick: wp.array(dtype=real),
        x: wp.array(dtype=vec3),
        v: wp.array(dtype=vec3),
        flag: wp.array(dtype=wp.int32),
    ):
        b = first + wp.tid()
        w = world[b]
        found = outside(begin[b], end[b], lower[w], upper[w], speed[w], quick[w], x, v)
        if found == 1 or found == 3:
            flag[0] = 1  # every writer writes the same
        if found >= 2:
            flag[1] = 1

    return check_limits


@functools.cache
def peak_kernel(precision: Precision) -> wp.Kernel:
    """Kernel: the largest |v_a| that each particle has had; what is not finite stays."""
    vec3, real = precision.vec3, precision.scalar

    @register
    def note_peak(first: int, v: wp.array(dtype=vec3), peak_io: wp.array(dtype=real)):
        i = first + wp.tid()
        v_i = v[i]
        for a in range(3):
            s = wp.abs(v_i[a])
            if not (s <= peak_io[i]) and wp.isfinite(peak_io[i]):
                peak_io[i] = s

    return note_peak


@functools.cache
def hold_kernel(dtype: Any) -> wp.Kernel:
    """Kernel: rows of frozen worlds go back to what they were at the start of the frame."""

    @register
    def hold_rows(
        first: int,
        world: wp.array(dtype=wp.int32),
        frozen: wp.array(dtype=wp.int32),
        start: wp.array(dtype=dtype),
        array_io: wp.array(dtype=dtype),
    ):
        i = first + wp.tid()
        if frozen[world[i]] != 0:
            array_io[i] = start[i]

    return hold_rows
