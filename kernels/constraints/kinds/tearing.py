"""Hinges of a sheet that go with its edges."""

import functools

import warp as wp

from ...precision import register

SIDES = ((0, 1), (0, 2), (1, 2), (0, 3), (1, 3))  # of both triangles of a hinge
Sides = wp.types.vector(length=len(SIDES), dtype=wp.int32)


@functools.cache
def tear_kernel() -> wp.Kernel:
    """Kernel: a hinge breaks of which a side is torn; ``side`` has its rows in ``torn``, or -1."""

    @register
    def tear_hinges(
        first: int, side: wp.array(dtype=Sides), torn: wp.array(dtype=wp.int32),
        broken_out: wp.array(dtype=wp.int32),
    ):  # fmt: skip
        r = first + wp.tid()
        rows = side[r]
        for k in range(wp.static(len(SIDES))):
            if rows[k] >= 0:
                if torn[rows[k]] != 0:
                    broken_out[r] = 1

    return tear_hinges
