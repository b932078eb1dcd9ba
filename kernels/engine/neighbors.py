"""Verlet lists: cell coordinates, rows from a hash grid or by looking at a whole world.

The grid is built in cell coordinates u = turn (x - origin), in which every cell is a unit cube.
``turn`` scales, and takes the axes in the order that has the grid's order follow the particles'
own. On a periodic axis it scales by cells / length, so that the grid's wrap by modulo is exactly
the periodicity of the box, whatever its shape. Slots (the loop's order) follow the grid's order.
"""

import functools
from types import SimpleNamespace
from typing import Any

import warp as wp

from ..precision import Precision, function, native, register, structure
from .loops import Pairs, Periodicity, box_type, minimum_image

BLOCK = 32  # candidates whose distances are computed together
SPARE = 8  # entries at the end of a row that the native build may overwrite

# For each mask of eight hits, the lanes of its set bits, one byte each, lowest first.
_LANES = ",".join(
    f"{sum(lane << (8 * k) for k, lane in enumerate(b for b in range(8) if mask >> b & 1)):#x}ull"
    for mask in range(256)
)


@functools.cache
def cells_type(precision: Precision) -> Any:
    """Origin and turn of a world's cell coordinates, and the first slot of the world."""
    return structure(
        f"Cells_{precision.name}",
        {"origin": precision.vec3, "turn": precision.mat33, "first": wp.int32, "world": wp.int32},
    )


def _scan(precision: Precision, periodic: Periodicity) -> wp.Function:
    """Native: append to the row of slot i every slot of [a, b) nearer than the reach."""
    real, Box = precision.c, box_type(precision)
    image = "\n".join(
        f"            d{axis} -= box.length[{n}] * __builtin_floor{'f' if real == 'float' else ''}"
        f"(d{axis} * box.inverse[{n}] + ({real})0.5);"
        for n, (axis, on) in enumerate(zip("xyz", periodic, strict=True))
        if on
    )
    # Hits first, one byte each, in a loop of fixed length that vectorises (the planes are padded
    # for it). Then eight at a time, without a branch: the hits as a bit mask look up which lanes
    # they are, and all eight are written, those behind the hits to be overwritten. A row keeps
    # SPARE entries beyond its capacity for that, which take what overflows as well.
    snippet = f"""
    const long long stride = x.shape[1];
    const {real}* px = (const {real}*)x.data;
    const {real}* py = px + stride;
    const {real}* pz = py + stride;
    const {real} xi = px[i], yi = py[i], zi = pz[i];
    int* row = pairs.index.data + (long long)i * pairs.row_stride;
    const int capacity = pairs.capacity;
    static const unsigned long long lanes[256] = {{{_LANES}}};
    for (int at = a; at < b; at += {BLOCK}) {{
        unsigned char hit[{BLOCK}];
#pragma clang loop vectorize(enable)
        for (int k = 0; k < {BLOCK}; ++k) {{
            {real} dx = xi - px[at + k], dy = yi - py[at + k], dz = zi - pz[at + k];
{image}
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

    def scan(
        i: int, a: int, b: int, n: int, pairs: Pairs, box: Box,
        x: wp.array2d(dtype=precision.scalar), reach_squared: precision.scalar,
    ) -> wp.int32: ...  # fmt: skip

    return native(scan, snippet, after_gradients=False)


def _append(precision: Precision) -> wp.Function:
    """Plain: append slot j to the row of slot i, which holds n, if it is near enough."""
    real = precision.scalar

    def append(i: int, j: int, n: int, r2: real, reach_squared: real, pairs: Pairs):
        result = n
        if j != i and r2 < reach_squared:
            if n < pairs.capacity:
                at = wp.int64(i) * pairs.row_stride + wp.int64(n) * pairs.entry_stride
                pairs.index[at] = j
            result = n + 1
        return result

    return function(append)


def _visit_cells(precision: Precision, periodic: Periodicity) -> wp.Function:
    """Native: scan the cells around u; slots of a cell are contiguous, its range is in the grid."""
    real, vec3, Box = precision.c, precision.vec3, box_type(precision)
    scan = _scan(precision, periodic)
    snippet = f"""
    auto q = wp::hash_grid_query(grid, u, ({real})1);
    const auto& g = q.grid;
    const int nx = ((q.x_start % g.dim_x) + g.dim_x) % g.dim_x;
    int n = 0;
    for (int z = q.z_start; z <= q.z_end; ++z)
    for (int y = q.y_start; y <= q.y_end; ++y) {{
        // Cells along x follow each other in the sorted order, but for the wrap: scan whole runs.
        const int line = wp::hash_grid_index(g, 0, y, z);
        int begin = 0, end = 0;
        for (int x_cell = q.x_start, cx = nx; x_cell <= q.x_end; ++x_cell) {{
            const int from = g.cell_starts[line + cx], to = g.cell_ends[line + cx];
            cx = cx + 1 < g.dim_x ? cx + 1 : 0;
            if (from == to) continue;
            if (from == end) {{ end = to; continue; }}
            n = {scan.native_func}(i, first + begin, first + end, n, pairs, box, x, reach_squared);
            begin = from; end = to;
        }}
        n = {scan.native_func}(i, first + begin, first + end, n, pairs, box, x, reach_squared);
    }}
    return n;
"""

    def visit_cells(
        i: int, grid: wp.uint64, u: vec3, first: int, pairs: Pairs, box: Box,
        x: wp.array2d(dtype=precision.scalar), reach_squared: precision.scalar,
    ) -> wp.int32: ...  # fmt: skip

    return native(visit_cells, snippet, after_gradients=False), scan


@functools.cache
def moved_kernel(precision: Precision, periodic: Periodicity) -> wp.Kernel:
    """Flag each world in which a slot has moved further than its margin (half the skin)."""
    vec3, real, Box = precision.vec3, precision.scalar, box_type(precision)
    image = minimum_image(precision, periodic)

    @register
    def flag_moved(
        first: int,
        members: wp.array(dtype=wp.int32),
        world: wp.array(dtype=wp.int32),
        box: wp.array(dtype=Box),
        margin_squared: wp.array(dtype=real),
        x: wp.array(dtype=vec3),
        x_listed: wp.array(dtype=vec3),
        moved: wp.array(dtype=wp.int32),
        any_moved: wp.array(dtype=wp.int32),
    ):
        k = first + wp.tid()
        w = world[k]
        d = image(x[members[k]] - x_listed[k], box[w])
        if wp.dot(d, d) > margin_squared[w]:
            # Every writer writes the same, and once: threads would fight over the cache line.
            if moved[w] == 0:
                moved[w] = 1
            if any_moved[0] == 0:
                any_moved[0] = 1

    return flag_moved


@functools.cache
def build_kernels(precision: Precision) -> SimpleNamespace:
    """Kernels around a build that do not look at pairs."""
    vec3, Cells = precision.vec3, cells_type(precision)

    @register
    def take_positions(
        first: int,
        members: wp.array(dtype=wp.int32),
        world: wp.array(dtype=wp.int32),
        moved: wp.array(dtype=wp.int32),
        x: wp.array(dtype=vec3),
        x_listed_out: wp.array(dtype=vec3),
    ):
        k = first + wp.tid()
        if moved[world[k]] != 0:
            x_listed_out[k] = x[members[k]]

    @register
    def spread(
        first: int, x_listed: wp.array(dtype=vec3), planes_out: wp.array2d(dtype=precision.scalar)
    ):
        """Coordinates in planes, which vector units load without shuffling."""
        k = first + wp.tid()
        for a in range(3):
            planes_out[a, k] = x_listed[k][a]

    @register
    def cell_coordinates(
        first: int, cells: Cells, x_listed: wp.array(dtype=vec3), u_out: wp.array(dtype=vec3)
    ):
        k = cells.first + first + wp.tid()
        u_out[k] = cells.turn * (x_listed[k] - cells.origin)

    @register
    def sort_slots(
        first: int,
        grid: wp.uint64,
        cells: Cells,
        members: wp.array(dtype=wp.int32),
        x_listed: wp.array(dtype=vec3),
        order_out: wp.array(dtype=wp.int32),
        slot_out: wp.array(dtype=wp.int32),
        planes_out: wp.array2d(dtype=precision.scalar),
    ):
        k = first + wp.tid()
        member = cells.first + wp.hash_grid_point_id(grid, k)
        order_out[cells.first + k] = members[member]
        slot_out[member] = cells.first + k
        for a in range(3):
            planes_out[a, cells.first + k] = x_listed[member][a]

    return SimpleNamespace(
        take_positions=take_positions, spread=spread, cell_coordinates=cell_coordinates,
        sort_slots=sort_slots,
    )  # fmt: skip


@functools.cache
def grid_rows_kernel(precision: Precision, periodic: Periodicity, vectorised: bool) -> wp.Kernel:
    """Rows of one world's slots from its hash grid."""
    vec3, real, Box = precision.vec3, precision.scalar, box_type(precision)
    Cells = cells_type(precision)
    image, append = minimum_image(precision, periodic), _append(precision)
    visit, scan = _visit_cells(precision, periodic)

    def query(
        i: int, grid: wp.uint64, u: vec3, cells: Cells, slot: wp.array(dtype=wp.int32),
        pairs: Pairs, box: Box, x: wp.array2d(dtype=real), reach_squared: real,
    ):  # fmt: skip
        n = int(0)
        k = int(0)
        candidates = wp.hash_grid_query(grid, u, real(1.0))
        while wp.hash_grid_query_next(candidates, k):
            j = slot[cells.first + k]
            d = image(vec3(x[0, i] - x[0, j], x[1, i] - x[1, j], x[2, i] - x[2, j]), box)
            n = append(i, j, n, wp.dot(d, d), reach_squared, pairs)
        return n

    look = function(query)

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
        b = box[cells.world]
        reach2 = reach_squared[cells.world]
        u = cells.turn * (vec3(x[0, i], x[1, i], x[2, i]) - cells.origin)
        n = int(0)
        if wp.static(vectorised):
            n = scan(i, 0, 0, 0, pairs, b, x, reach2)  # has Warp emit it before `visit`
            n = visit(i, grid, u, cells.first, pairs, b, x, reach2)
        else:
            n = look(i, grid, u, cells, slot, pairs, b, x, reach2)
        pairs.count[i] = n
        if n > pairs.capacity:
            overflow[0] = 1

    return grid_rows


@functools.cache
def direct_rows_kernel(precision: Precision, periodic: Periodicity, vectorised: bool) -> wp.Kernel:
    """Rows by looking at every slot of the own world: fastest for small worlds."""
    vec3, real, Box = precision.vec3, precision.scalar, box_type(precision)
    image, append = minimum_image(precision, periodic), _append(precision)
    scan = _scan(precision, periodic)

    def look(
        i: int, a: int, b: int, pairs: Pairs, box: Box, x: wp.array2d(dtype=real),
        reach_squared: real,
    ):  # fmt: skip
        n = int(0)
        for j in range(a, b):
            d = image(vec3(x[0, i] - x[0, j], x[1, i] - x[1, j], x[2, i] - x[2, j]), box)
            n = append(i, j, n, wp.dot(d, d), reach_squared, pairs)
        return n

    every = function(look)

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
            n = int(0)
            if wp.static(vectorised):
                n = scan(i, pairs.begin[w], pairs.end[w], 0, pairs, box[w], x, reach_squared[w])
            else:
                n = every(i, pairs.begin[w], pairs.end[w], pairs, box[w], x, reach_squared[w])
            pairs.count[i] = n
            if n > pairs.capacity:
                overflow[0] = 1

    return direct_rows


@functools.cache
def gather_kernel(dtype: type) -> wp.Kernel:
    """Copy a per-particle array into slot order."""

    @register
    def gather(
        first: int,
        order: wp.array(dtype=wp.int32),
        source: wp.array(dtype=dtype),
        sorted_out: wp.array(dtype=dtype),
    ):
        i = first + wp.tid()
        sorted_out[i] = source[order[i]]

    return gather
