"""The loops over neighbours: one skeleton into which every pair term is plugged.

A *term* gives what particle j contributes to particle i, by a Warp function ``(i, j, x_ij, r2, d,
p)``. It reads per-particle arrays from the struct ``d`` (which always holds the positions ``x`` and
the ``slot`` of each particle) at the indices i and j, and parameters from the struct ``p`` (which
always holds ``cutoff_squared``). The loop sums the terms over the pairs within the cutoff; a
coincident pair, r = 0, reaches the term as it is.

Two builders make the same loop: :func:`plain_loop`, the reference, in Warp's own language for CUDA,
and :func:`~.packed.packed_loop` in C++ for the CPU's vector units. There i and j are places in
copies that the loop has made, and only ``d.slot`` tells which particle is the first of a pair.
"""

import functools
from dataclasses import dataclass
from typing import Any

import warp as wp

from ..precision import Precision, function, native, structure
from ..warp_internals import elements, vector

# Where the partners of slot i are: a row of a neighbour list, or the whole range of i's world.
ROWS = "rows"
ALL = "all"


@dataclass(frozen=True)
class Periodicity:
    """Which axes are periodic; none leaves the minimum image out of the compiled code."""

    x: bool = False
    y: bool = False
    z: bool = False

    def __iter__(self):
        return iter((self.x, self.y, self.z))

    def __bool__(self) -> bool:
        return self.x or self.y or self.z


@dataclass(frozen=True)
class Term:
    """What a loop sums.

    A *central* one, with a ``direction``, gives two numbers (w, push): the contribution is then
    w x_ij + push direction, the second for coincident pairs, whose x_ij is zero.

    Args:
        function: ``(i, j, x_ij, r2, d, p)``, which gives a vector. It is also evaluated where
            nothing comes of it, as beyond the cutoff and at an infinite r2: it stays within arrays.
        width: Numbers of the sum.
        direction: Of unit length.
        rounding: As the compiler may have it: a product and a sum in one; or ``"any"``, with
            products of reciprocals in place of quotients, and in any order, too. None: as written.
        placed: Its positions are places in the box, and not seen from somewhere.
        stored_in_line: What stores the sums has no branch: several slots at once.
    """

    function: wp.Function
    width: int
    direction: tuple[float, float, float] | None = None
    rounding: str | None = "fused"
    placed: bool = True
    stored_in_line: bool = False

    @property
    def returned(self) -> int:
        """Numbers that the function gives."""
        return self.width if self.direction is None else 2


@wp.struct
class Pairs:
    """Partners of every cluster of slots: list rows, or ranges.

    Slots are particles in the loop's own order. The slots of a cluster follow each other and share
    a row, which holds themselves too where they are more than one.
    """

    order: wp.array(dtype=wp.int32)  # slot -> particle
    world: wp.array(dtype=wp.int32)  # slot -> world
    begin: wp.array(dtype=wp.int32)  # world -> first slot
    end: wp.array(dtype=wp.int32)  # world -> last slot + 1
    lead: wp.array(dtype=wp.int32)  # cluster -> its first slot, and at the end that of one more
    cluster: wp.array(dtype=wp.int32)  # slot -> cluster
    count: wp.array(dtype=wp.int32)  # cluster -> entries of its row
    row: wp.array(dtype=wp.int64)  # cluster -> where its row begins
    index: wp.array(dtype=wp.int32)  # the rows, slots
    entry_stride: wp.int64


def box_type(precision: Precision) -> Any:
    """Periodic box of a world: side lengths and their inverses, 0 on open axes."""
    fields = {k: precision.vec3 for k in ("lower", "length", "inverse")}
    return structure(f"Box_{precision.name}", fields)


def minimum_image(precision: Precision, periodic: Periodicity) -> wp.Function:
    """d - L round(d / L) on the periodic axes.

    Rounding half to even is odd: two particles half a box apart see each other in opposite
    directions.
    """
    vec3, Box = precision.vec3, box_type(precision)
    on_x, on_y, on_z = (int(axis) for axis in periodic)

    def nearest_image(d: vec3, box: Box):
        result = d
        if wp.static(on_x):
            result[0] = d[0] - box.length[0] * wp.rint(d[0] * box.inverse[0])
        if wp.static(on_y):
            result[1] = d[1] - box.length[1] * wp.rint(d[1] * box.inverse[1])
        if wp.static(on_z):
            result[2] = d[2] - box.length[2] * wp.rint(d[2] * box.inverse[2])
        return result

    return function(nearest_image)


@functools.cache
def reader(precision: Precision, width: int | None = None) -> wp.Function:
    """``read(array, j)`` of numbers, or of vectors by their components, from an array without gaps.

    Warp's own reading computes with strides and loads a vector as a whole; the first slows a
    vectorised loop, the second keeps the compiler from vectorising it.
    """
    real = precision.c
    if width is None:
        kind, body = precision.scalar, "data[j]"
    else:
        kind = precision.vector(width)
        components = ", ".join(f"data[{width} * (long long)j + {c}]" for c in range(width))
        body = f"{vector(width, real)}({components})"
    snippet = f"""
    const {real}* data = {elements("array", real)};
    return {body};
"""

    def read(array: wp.array(dtype=kind), j: int) -> kind: ...

    return native(read, snippet, after_gradients=False)


def plain_loop(
    term: Term, data: Any, params: Any, precision: Precision, periodic: Periodicity, partners: str
) -> wp.Function:
    """The loop in Warp's own language: ``loop(i, pairs, box, d, p) -> vector(width)``."""
    Box, total = box_type(precision), precision.vector(term.width)
    image, give = minimum_image(precision, periodic), term.function
    rows, central = partners == ROWS, term.direction is not None
    aside = precision.vec3(*(term.direction or (0.0, 0.0, 0.0)))

    def plain_sum(i: int, pairs: Pairs, box: Box, d: data, p: params):
        x_i = d.x[i]
        result = total()
        row = wp.int64(0)
        if wp.static(rows):
            row = pairs.row[pairs.cluster[i]]
            first = 0
            last = pairs.count[pairs.cluster[i]]
        else:
            first = pairs.begin[pairs.world[i]]
            last = pairs.end[pairs.world[i]]
        for k in range(first, last):
            j = k
            if wp.static(rows):
                j = pairs.index[row + wp.int64(k) * pairs.entry_stride]
            x_ij = image(x_i - d.x[j], box)
            r2 = wp.dot(x_ij, x_ij)
            if j != i and r2 < p.cutoff_squared:
                t = give(i, j, x_ij, r2, d, p)
                if wp.static(central):
                    result += x_ij * t[0] + aside * t[1]
                else:
                    result += t
        return result

    return function(plain_sum, after_gradients=True)
