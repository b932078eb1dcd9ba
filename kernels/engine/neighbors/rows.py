"""Rows of Verlet lists for CUDA: to each slot the slots within reach, by a hash grid or directly.

Every slot is a cluster of its own. What a row has no room for is counted and left out. On a CPU
clusters of slots share their rows (:mod:`particlesim.kernels.engine.neighbors.clusters`).
"""

import functools

import warp as wp

from ...precision import Precision, function, register
from ..loops import Pairs, Periodicity, box_type, minimum_image
from .boxes import cell_function
from .renewal import blocks_type, cells_type


@functools.cache
def row_functions(
    precision: Precision, periodic: Periodicity, own: bool = False
) -> tuple[wp.Function, wp.Function]:
    """Two functions that append to the row of slot i, which holds n entries.

    ``of_range`` looks at the slots from a to b - 1, ``of_cells`` at those in the cells around u,
    the slot's own cell coordinates, as far as ``radius`` cells. Both return how many it then has.
    With reaches of its ``own`` each particle is looked for as far as the farther of two says.
    """
    vec3, real, Box = precision.vec3, precision.scalar, box_type(precision)
    image, Cells = minimum_image(precision, periodic), cells_type(precision)

    def append(
        i: int, j: int, n: int, room: int, pairs: Pairs, box: Box, x: wp.array2d(dtype=real),
        reach_squared: real,
    ):  # fmt: skip
        d = image(vec3(x[0, i] - x[0, j], x[1, i] - x[1, j], x[2, i] - x[2, j]), box)
        result = n
        within = reach_squared
        if wp.static(own):
            within = wp.max(x[3, i], x[3, j])
        if j != i and wp.dot(d, d) < within:
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


@functools.cache
def grid_rows_kernel(
    precision: Precision, periodic: Periodicity, flexible: bool, own: bool = False
) -> wp.Kernel:
    """Rows of one block's slots from the hash grid of one; ``more``: behind what is in them."""
    vec3, real, Box = precision.vec3, precision.scalar, box_type(precision)
    Cells, Blocks = cells_type(precision), blocks_type(precision)
    _of_range, of_cells = row_functions(precision, periodic, own)
    cell = cell_function(precision, flexible)

    @register
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
        b = box[cells.world]
        u = cell(vec3(x[0, i], x[1, i], x[2, i]), cells, b)
        n = int(0)
        if more != 0:
            n = found_io[i]
        wide = radius
        if wp.static(flexible):  # cells have grown with the box
            wide = radius * cells.length[0] * b.inverse[0]
        n = of_cells(i, n, grid, u, wide, cells, slot, room, pairs, b, x, reach_squared)
        found_io[i] = n
        pairs.count[i] = wp.min(n, room)
        if n > room:
            overflow[0] = 1

    return grid_rows


@functools.cache
def direct_rows_kernel(precision: Precision, periodic: Periodicity, own: bool = False) -> wp.Kernel:
    """Rows by looking at every slot of the own world: fastest for small worlds."""
    real, Box, Blocks = precision.scalar, box_type(precision), blocks_type(precision)
    of_range, _of_cells = row_functions(precision, periodic, own)

    @register
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
