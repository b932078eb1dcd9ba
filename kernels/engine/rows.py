"""Rows of Verlet lists: to each slot the slots within reach, from a hash grid or a whole world.

Two functions append to the row of slot i, which holds n entries, and return how many it then has:
``of_range`` looks at the slots from a to b - 1, ``of_cells`` at those in the cells around u, the
slot's own cell coordinates, as far as ``radius`` cells. They are made twice: in Warp's language for
CUDA, and in C++ for the CPU's vector units. Both give the same rows in the same order. What a row
has no room for is counted and left out.
"""

import functools
from typing import Any

import warp as wp

from ..precision import Precision, function, native, register, structure
from ..warp_internals import columns, elements, grid_runs, native_name
from .loops import Pairs, Periodicity, box_type, minimum_image, native_image
from .neighbors import cells_type

BLOCK = 32  # candidates whose distances are computed together
SPARE = 8  # entries at the end of a row that the native build may overwrite

# For each mask of eight hits, the lanes of its set bits, one byte each, lowest first.
_LANES = ",".join(
    f"{sum(lane << (8 * k) for k, lane in enumerate(b for b in range(8) if mask >> b & 1)):#x}ull"
    for mask in range(256)
)


def blocks_type(precision: Precision) -> Any:
    """The blocks of all worlds: their slots, how far they reach, and the room in their rows."""
    return structure(
        f"Blocks_{precision.name}",
        {
            "of": wp.array(dtype=wp.int32),  # slot -> block
            "begin": wp.array(dtype=wp.int32),  # block -> first slot
            "end": wp.array(dtype=wp.int32),  # block -> last slot + 1
            "room": wp.array(dtype=wp.int32),  # block -> entries that a row has room for
            "first": wp.array(dtype=wp.int32),  # world -> first block
            "reach_squared": wp.array2d(dtype=precision.scalar),  # block, other of its world
        },
    )


def row_functions(
    precision: Precision, periodic: Periodicity, vectorised: bool
) -> tuple[wp.Function, wp.Function]:
    """``of_range`` and ``of_cells``."""
    if vectorised:
        of_range = _native_range(precision, periodic)
        return of_range, _native_cells(of_range, precision)
    return _plain_functions(precision, periodic)


def _plain_functions(
    precision: Precision, periodic: Periodicity
) -> tuple[wp.Function, wp.Function]:
    """Both in Warp's own language."""
    vec3, real, Box = precision.vec3, precision.scalar, box_type(precision)
    image, Cells = minimum_image(precision, periodic), cells_type(precision)

    def append(
        i: int, j: int, n: int, room: int, pairs: Pairs, box: Box, x: wp.array2d(dtype=real),
        reach_squared: real,
    ):  # fmt: skip
        d = image(vec3(x[0, i] - x[0, j], x[1, i] - x[1, j], x[2, i] - x[2, j]), box)
        result = n
        if j != i and wp.dot(d, d) < reach_squared:
            if n < room:
                pairs.index[pairs.row[i] + wp.int64(n) * pairs.entry_stride] = j
            result = n + 1
        return result

    add = function(append)

    def of_range(
        i: int, a: int, b: int, n: int, room: int, pairs: Pairs, box: Box,
        x: wp.array2d(dtype=real), reach_squared: real,
    ):  # fmt: skip
        result = n
        for j in range(a, b):
            result = add(i, j, result, room, pairs, box, x, reach_squared)
        return result

    def of_cells(
        i: int, n: int, grid: wp.uint64, u: vec3, radius: real, cells: Cells,
        slot: wp.array(dtype=wp.int32), room: int, pairs: Pairs, box: Box,
        x: wp.array2d(dtype=real), reach_squared: real,
    ):  # fmt: skip
        result = n
        k = int(0)
        candidates = wp.hash_grid_query(grid, u, radius)
        while wp.hash_grid_query_next(candidates, k):
            result = add(i, slot[cells.first + k], result, room, pairs, box, x, reach_squared)
        return result

    return function(of_range), function(of_cells)


def _native_range(precision: Precision, periodic: Periodicity) -> wp.Function:
    """``of_range`` in C++."""
    real, Box = precision.c, box_type(precision)
    # Hits first, one byte each, in a loop of fixed length that vectorises (the planes are padded
    # for it). Then eight at a time, without a branch: the hits as a bit mask look up which lanes
    # they are, and all eight are written, those behind the hits to be overwritten. A row keeps
    # SPARE entries beyond its capacity for that, which take what overflows as well.
    snippet = f"""
    const long long stride = {columns("x")};
    const {real}* px = {elements("x", real)};
    const {real}* py = px + stride;
    const {real}* pz = py + stride;
    const {real} xi = px[i], yi = py[i], zi = pz[i];
    int* row = {elements("pairs.index", "int")} + {elements("pairs.row", "long long")}[i];
    static const unsigned long long lanes[256] = {{{_LANES}}};
    for (int at = a; at < b; at += {BLOCK}) {{
        unsigned char hit[{BLOCK}];
#pragma clang loop vectorize(enable)
        for (int k = 0; k < {BLOCK}; ++k) {{
            {real} dx = xi - px[at + k], dy = yi - py[at + k], dz = zi - pz[at + k];
            {native_image(precision, periodic)}
            hit[k] = dx*dx + dy*dy + dz*dz < reach_squared;
        }}
        for (int k = 0; k < {BLOCK} && at + k < b; k += 8) {{
            unsigned long long word;
            __builtin_memcpy(&word, hit + k, 8);
            if (b - at - k < 8) word &= (1ull << (8 * (b - at - k))) - 1;
            const unsigned own = (unsigned)(i - at - k);
            if (own < 8) word &= ~(0xffull << (8 * own));
            const unsigned mask = (word * 0x0102040810204080ull) >> 56;
            const unsigned long long picks = lanes[mask];
            int* out = row + (n < room ? n : room);
            for (int t = 0; t < 8; ++t) out[t] = at + k + (int)((picks >> (8 * t)) & 0xff);
            n += __builtin_popcount(mask);
        }}
    }}
    return n;
"""

    def of_range(
        i: int, a: int, b: int, n: int, room: int, pairs: Pairs, box: Box,
        x: wp.array2d(dtype=precision.scalar), reach_squared: precision.scalar,
    ) -> wp.int32: ...  # fmt: skip

    return native(of_range, snippet, after_gradients=False)


def _native_cells(of_range: wp.Function, precision: Precision) -> wp.Function:
    """``of_cells`` in C++: the slots of a cell are contiguous, and its range is in the grid."""
    vec3, real, Box = precision.vec3, precision.scalar, box_type(precision)
    Cells, name = cells_type(precision), native_name(of_range)
    run = "cells.first + begin, cells.first + end"
    visit = f"n = {name}(i, {run}, n, room, pairs, box, x, reach_squared);"
    snippet = f"""
    {grid_runs("grid", "u", "radius", visit)}
    return n;
"""

    def of_cells(
        i: int, n: int, grid: wp.uint64, u: vec3, radius: real, cells: Cells,
        slot: wp.array(dtype=wp.int32), room: int, pairs: Pairs, box: Box,
        x: wp.array2d(dtype=real), reach_squared: real,
    ) -> wp.int32:  # fmt: skip
        of_range(i, 0, 0, 0, 0, pairs, box, x, reach_squared)

    return native(of_cells, snippet, after_gradients=False)


@functools.cache
def grid_rows_kernel(precision: Precision, periodic: Periodicity, vectorised: bool) -> wp.Kernel:
    """Rows of one block's slots from the hash grid of one; ``more``: behind what is in them."""
    vec3, real, Box = precision.vec3, precision.scalar, box_type(precision)
    Cells, Blocks = cells_type(precision), blocks_type(precision)
    _of_range, of_cells = row_functions(precision, periodic, vectorised)

    @functools.partial(register, cpu_only=vectorised)
    def grid_rows(
        first: int,
        grid: wp.uint64,
        cells: Cells,
        begin: int,
        radius: real,
        more: int,
        box: wp.array(dtype=Box),
        reach_squared: real,
        blocks: Blocks,
        slot: wp.array(dtype=wp.int32),
        x: wp.array2d(dtype=real),
        pairs: Pairs,
        found_io: wp.array(dtype=wp.int32),
        overflow: wp.array(dtype=wp.int32),
    ):
        i = begin + first + wp.tid()
        room = blocks.room[blocks.of[i]]
        u = cells.turn * (vec3(x[0, i], x[1, i], x[2, i]) - cells.origin)
        n = int(0)
        if more != 0:
            n = found_io[i]
        b = box[cells.world]
        n = of_cells(i, n, grid, u, radius, cells, slot, room, pairs, b, x, reach_squared)
        found_io[i] = n
        pairs.count[i] = wp.min(n, room)
        if n > room:
            overflow[0] = 1

    return grid_rows


@functools.cache
def direct_rows_kernel(precision: Precision, periodic: Periodicity, vectorised: bool) -> wp.Kernel:
    """Rows by looking at every slot of the own world: fastest for small worlds."""
    real, Box, Blocks = precision.scalar, box_type(precision), blocks_type(precision)
    of_range, _of_cells = row_functions(precision, periodic, vectorised)

    @functools.partial(register, cpu_only=vectorised)
    def direct_rows(
        first: int,
        direct: wp.array(dtype=wp.int32),
        box: wp.array(dtype=Box),
        moved: wp.array(dtype=wp.int32),
        blocks: Blocks,
        x: wp.array2d(dtype=real),
        pairs: Pairs,
        found_out: wp.array(dtype=wp.int32),
        overflow: wp.array(dtype=wp.int32),
    ):
        i = first + wp.tid()
        w = pairs.world[i]
        if moved[w] != 0 and direct[w] != 0:
            own = blocks.of[i]
            room = blocks.room[own]
            n = int(0)
            for k in range(blocks.first[w + 1] - blocks.first[w]):
                other = blocks.first[w] + k
                a, b = blocks.begin[other], blocks.end[other]
                n = of_range(i, a, b, n, room, pairs, box[w], x, blocks.reach_squared[own, k])
            found_out[i] = n
            pairs.count[i] = wp.min(n, room)
            if n > room:
                overflow[0] = 1

    return direct_rows
