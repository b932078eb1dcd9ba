"""Rows of Verlet lists: to each slot the slots within reach, from a hash grid or a whole world.

Two functions append to the row of slot i, which holds n entries, and return how many it then has:
``of_range`` looks at the slots from a to b - 1, ``of_cells`` at those in the cells around u, the
slot's own cell coordinates. They are made twice: in Warp's language for CUDA, and in C++ for the
CPU's vector units. Both give the same rows in the same order. What a row has no room for is counted
and left out.
"""

import functools

import warp as wp

from ..precision import Precision, function, native, register
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
        i: int, j: int, n: int, pairs: Pairs, box: Box, x: wp.array2d(dtype=real),
        reach_squared: real,
    ):  # fmt: skip
        d = image(vec3(x[0, i] - x[0, j], x[1, i] - x[1, j], x[2, i] - x[2, j]), box)
        result = n
        if j != i and wp.dot(d, d) < reach_squared:
            if n < pairs.capacity:
                at = wp.int64(i) * pairs.row_stride + wp.int64(n) * pairs.entry_stride
                pairs.index[at] = j
            result = n + 1
        return result

    add = function(append)

    def of_range(
        i: int, a: int, b: int, n: int, pairs: Pairs, box: Box, x: wp.array2d(dtype=real),
        reach_squared: real,
    ):  # fmt: skip
        result = n
        for j in range(a, b):
            result = add(i, j, result, pairs, box, x, reach_squared)
        return result

    def of_cells(
        i: int, grid: wp.uint64, u: vec3, cells: Cells, slot: wp.array(dtype=wp.int32),
        pairs: Pairs, box: Box, x: wp.array2d(dtype=real), reach_squared: real,
    ):  # fmt: skip
        n = int(0)
        k = int(0)
        candidates = wp.hash_grid_query(grid, u, real(1.0))
        while wp.hash_grid_query_next(candidates, k):
            n = add(i, slot[cells.first + k], n, pairs, box, x, reach_squared)
        return n

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
    int* row = {elements("pairs.index", "int")} + (long long)i * pairs.row_stride;
    const int capacity = pairs.capacity;
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
            int* out = row + (n < capacity ? n : capacity);
            for (int t = 0; t < 8; ++t) out[t] = at + k + (int)((picks >> (8 * t)) & 0xff);
            n += __builtin_popcount(mask);
        }}
    }}
    return n;
"""

    def of_range(
        i: int, a: int, b: int, n: int, pairs: Pairs, box: Box,
        x: wp.array2d(dtype=precision.scalar), reach_squared: precision.scalar,
    ) -> wp.int32: ...  # fmt: skip

    return native(of_range, snippet, after_gradients=False)


def _native_cells(of_range: wp.Function, precision: Precision) -> wp.Function:
    """``of_cells`` in C++: the slots of a cell are contiguous, and its range is in the grid."""
    vec3, real, Box = precision.vec3, precision.scalar, box_type(precision)
    Cells, name = cells_type(precision), native_name(of_range)
    visit = (
        f"n = {name}(i, cells.first + begin, cells.first + end, n, pairs, box, x, reach_squared);"
    )
    snippet = f"""
    int n = 0;
    {grid_runs("grid", "u", precision.c, visit)}
    return n;
"""

    def of_cells(
        i: int, grid: wp.uint64, u: vec3, cells: Cells, slot: wp.array(dtype=wp.int32),
        pairs: Pairs, box: Box, x: wp.array2d(dtype=real), reach_squared: real,
    ) -> wp.int32:  # fmt: skip
        of_range(i, 0, 0, 0, pairs, box, x, reach_squared)

    return native(of_cells, snippet, after_gradients=False)


@functools.cache
def grid_rows_kernel(precision: Precision, periodic: Periodicity, vectorised: bool) -> wp.Kernel:
    """Rows of one world's slots from its hash grid."""
    vec3, real, Box = precision.vec3, precision.scalar, box_type(precision)
    Cells = cells_type(precision)
    _of_range, of_cells = row_functions(precision, periodic, vectorised)

    @functools.partial(register, cpu_only=vectorised)
    def grid_rows(
        first: int,
        grid: wp.uint64,
        cells: Cells,
        box: wp.array(dtype=Box),
        reach_squared: wp.array(dtype=real),
        slot: wp.array(dtype=wp.int32),
        x: wp.array2d(dtype=real),
        pairs: Pairs,
        overflow: wp.array(dtype=wp.int32),
    ):
        i = cells.first + first + wp.tid()
        w = cells.world
        u = cells.turn * (vec3(x[0, i], x[1, i], x[2, i]) - cells.origin)
        n = of_cells(i, grid, u, cells, slot, pairs, box[w], x, reach_squared[w])
        pairs.count[i] = n
        if n > pairs.capacity:
            overflow[0] = 1

    return grid_rows


@functools.cache
def direct_rows_kernel(precision: Precision, periodic: Periodicity, vectorised: bool) -> wp.Kernel:
    """Rows by looking at every slot of the own world: fastest for small worlds."""
    real, Box = precision.scalar, box_type(precision)
    of_range, _of_cells = row_functions(precision, periodic, vectorised)

    @functools.partial(register, cpu_only=vectorised)
    def direct_rows(
        first: int,
        direct: wp.array(dtype=wp.int32),
        box: wp.array(dtype=Box),
        reach_squared: wp.array(dtype=real),
        moved: wp.array(dtype=wp.int32),
        x: wp.array2d(dtype=real),
        pairs: Pairs,
        overflow: wp.array(dtype=wp.int32),
    ):
        i = first + wp.tid()
        w = pairs.world[i]
        if moved[w] != 0 and direct[w] != 0:
            a = pairs.begin[w]
            n = of_range(i, a, pairs.end[w], 0, pairs, box[w], x, reach_squared[w])
            pairs.count[i] = n
            if n > pairs.capacity:
                overflow[0] = 1

    return direct_rows
