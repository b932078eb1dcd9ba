"""Clusters of slots on a CPU: four particles that are near each other, and their partners.

A block of slots, in the order of :mod:`.columns`, is cut into *supers* of sixteen, and each of
these is halved along its longest side, twice, which makes four clusters of four. Worlds too small
for columns are halved all the way. The four of a super look for partners together: in the supers
near it, sixteen slots at a time.
"""

import functools
from types import SimpleNamespace
from typing import Any

import numpy as np
import warp as wp

from ...native import body
from ...precision import Precision, native, register, structure
from ...warp_internals import columns
from ..loops import Periodicity, box_type, minimum_image
from ..packed import CLUSTER
from .columns import SUPER, columns_type

SMALL = 512  # largest world that is halved all the way; measured


def supers_type(precision: Precision) -> Any:
    """Supers of all blocks."""
    fields = {
        "lead": wp.array(dtype=wp.int32),  # super -> first slot
        "block": wp.array(dtype=wp.int32),  # super -> block
        "first": wp.array(dtype=wp.int32),  # block -> first super, and at the end one more
        "cluster": wp.array(dtype=wp.int32),  # super -> first cluster
        "middle": wp.array2d(dtype=precision.scalar),  # axis, super: of the box around it
        "half": wp.array2d(dtype=precision.scalar),  # axis, super: half its lengths
    }
    return structure(f"Supers_{precision.name}", fields)


def _halved(precision: Precision, periodic: Periodicity) -> wp.Function:
    """``halve(first, n, box, order_io, x_io)``: slots by halves of their longest side."""
    Box = box_type(precision)
    numbers = {
        "MOST": SMALL, "SUPER": SUPER, "CLUSTER": CLUSTER, "PERIODIC": [int(on) for on in periodic],
    }  # fmt: skip
    arrays, macros = {"x": "x_io", "int* order": "order_io"}, {"stride": columns("x_io")}
    snippet = body("engine/neighbors/halve.cpp", precision, numbers, arrays, macros)

    def halve(
        first: int, n: int, box: Box, order_io: wp.array(dtype=wp.int32),
        x_io: wp.array2d(dtype=precision.scalar),
    ): ...  # fmt: skip

    return native(halve, snippet, after_gradients=False)


@functools.cache
def halving_kernels(precision: Precision, periodic: Periodicity) -> SimpleNamespace:
    """Kernels: small blocks halved all the way; supers of large ones halved, and boxed."""
    real, vec3, Box = precision.scalar, precision.vec3, box_type(precision)
    Supers, Columns = supers_type(precision), columns_type(precision)
    halve, image = _halved(precision, periodic), minimum_image(precision, periodic)
    rounding = real(8.0 * float(np.finfo(precision.numpy).eps))

    @functools.partial(register, cpu_only=True)
    def halve_blocks(
        first: int,
        moved: wp.array(dtype=wp.int32),
        blocks: wp.array(dtype=Columns),
        box: wp.array(dtype=Box),
        members: wp.array(dtype=wp.int32),
        x: wp.array(dtype=vec3),
        order_out: wp.array(dtype=wp.int32),
        planes_out: wp.array2d(dtype=real),
    ):
        c = blocks[first + wp.tid()]
        if moved[c.world] == 0 or c.most > 0:
            return
        for i in range(c.begin, c.end):
            order_out[i] = members[i]
            for a in range(3):
                planes_out[a, i] = x[i][a]
        halve(c.begin, c.end - c.begin, box[c.world], order_out, planes_out)

    @functools.partial(register, cpu_only=True)
    def halve_supers(
        first: int,
        moved: wp.array(dtype=wp.int32),
        blocks: wp.array(dtype=Columns),
        box: wp.array(dtype=Box),
        supers: Supers,
        order_io: wp.array(dtype=wp.int32),
        planes_io: wp.array2d(dtype=real),
    ):
        q = first + wp.tid()
        c = blocks[supers.block[q]]
        if moved[c.world] == 0:
            return
        s = supers.lead[q]
        n = wp.min(c.end - s, SUPER)
        b = box[c.world]
        if c.most > 0:
            halve(s, n, b, order_io, planes_io)
        # The box around it, in one piece.
        o = vec3(planes_io[0, s], planes_io[1, s], planes_io[2, s])
        low, high = vec3(), vec3()
        for i in range(s + 1, s + n):
            d = image(vec3(planes_io[0, i], planes_io[1, i], planes_io[2, i]) - o, b)
            low = wp.min(low, d)
            high = wp.max(high, d)
        for a in range(3):
            size = high[a] - low[a]
            supers.middle[a, q] = o[a] + real(0.5) * (low[a] + high[a])
            # Wider by what rounding may have moved the middle and the sides.
            supers.half[a, q] = real(0.5) * size + rounding * (wp.abs(o[a]) + size)

    return SimpleNamespace(blocks=halve_blocks, supers=halve_supers)
