"""Columns: slots in an order in which those that follow each other are near each other.

Cells whose side holds about sixteen particles are cut along one axis into bins. The columns of bins
follow each other like the furrows of a field, so that sixteen slots are close together wherever
they begin. ``wp.HashGrid`` sorts, by a number for each bin; the columns are laid anew over what a
block fills at every build.
"""

import functools
from types import SimpleNamespace
from typing import Any

import warp as wp

from ..precision import Precision, function, register, structure
from .loops import box_type

LINE = 256  # bins of the grid along its first axis


def columns_type(precision: Precision) -> Any:
    """Columns of a block: the cell along axis a is floor((x[axes[a]] - lower[a]) scale[a])."""
    vec3 = precision.vec3
    fields = {
        "begin": wp.int32,  # first slot of the block
        "end": wp.int32,
        "world": wp.int32,
        "axes": wp.vec3i,  # along bins, from column to column, from row to row of columns
        "backward": wp.vec3i,  # whether cells are numbered against the axis
        "wraps": wp.vec3i,  # whether it is periodic
        "lower": vec3,
        "scale": vec3,  # cells on a length of 1
        "dims": wp.vec3i,  # cells; 0 where a block has no columns
        "first": wp.int32,  # where its starts begin
        "most": wp.int32,  # bins that there is room for
    }
    return structure(f"Columns_{precision.name}", fields)


@functools.cache
def columns_kernels(precision: Precision) -> SimpleNamespace:
    """Kernels that sort a block by columns."""
    vec3, real, Box = precision.vec3, precision.scalar, box_type(precision)
    Columns = columns_type(precision)

    def cells_along(length: real, side: real, wraps: int):
        n = wp.max(int(wp.floor(length / side)), 1)
        if wraps == 0:
            n = int(wp.floor(length / side)) + 1
        return n

    along = function(cells_along)

    @functools.partial(register, cpu_only=True)
    def lay_columns(
        first: int,
        block: int,
        box: wp.array(dtype=Box),
        x: wp.array(dtype=vec3),
        columns_io: wp.array(dtype=Columns),
    ):
        """Over what a block fills: of the side that holds as many as a super, if even."""
        k = block + first + wp.tid()
        c = columns_io[k]
        o = x[c.begin]
        low = vec3(o)
        high = vec3(o)
        mean = vec3()
        square = vec3()
        for i in range(c.begin, c.end):
            y = x[i]
            low = wp.min(low, y)
            high = wp.max(high, y)
            mean += y - o
            square += wp.cw_mul(y - o, y - o)
        count = real(c.end - c.begin)
        length = vec3()
        spread = vec3()
        lower = vec3()
        largest = real(0.0)
        for a in range(3):
            b = c.axes[a]
            m = mean[b] / count
            # An even spread over a length L has the variance L^2 / 12; outliers count for little.
            spread[a] = wp.sqrt(real(12.0) * wp.max(square[b] / count - m * m, real(0.0)))
            length[a] = high[b] - low[b]
            lower[a] = low[b]
            if c.wraps[a] != 0:
                length[a] = box[c.world].length[b]
                lower[a] = box[c.world].lower[b]
            largest = wp.max(largest, length[a])
        side = wp.where(largest > real(0.0), largest, real(1.0))
        # The side with which what is spread evenly has one cell for each super.
        wanted = real(16.0) / count
        for _n in range(200):
            cells = (spread[0] / side + real(1.0)) * (spread[1] / side + real(1.0))
            if cells * (spread[2] / side + real(1.0)) * wanted >= real(1.0):
                break
            side = side * real(0.9)
        n = wp.vec3i(1, 1, 1)
        for _n in range(400):
            n[0] = along(length[0], side / real(8.0), c.wraps[0])
            n[1] = along(length[1], side, c.wraps[1])
            n[2] = along(length[2], side, c.wraps[2])
            if real(n[0]) * real(n[1]) * real(n[2]) <= real(c.most):
                break
            side = side * real(1.1)
        scale = vec3(real(8.0), real(1.0), real(1.0)) / side
        for a in range(3):
            if c.wraps[a] != 0:
                scale[a] = real(n[a]) / length[a]
        columns_io[k].lower = lower
        columns_io[k].scale = scale
        columns_io[k].dims = n

    def cell_of(x: vec3, a: int, c: Columns):
        n = c.dims[a]
        k = int(wp.floor((x[c.axes[a]] - c.lower[a]) * c.scale[a]))
        if c.wraps[a] != 0:
            k = k % n
            if k < 0:
                k += n
        k = wp.clamp(k, 0, n - 1)
        if c.backward[a] != 0:
            k = n - 1 - k
        return k

    cell = function(cell_of)

    @functools.partial(register, cpu_only=True)
    def number_bins(
        first: int,
        k: int,
        columns_in: wp.array(dtype=Columns),
        x: wp.array(dtype=vec3),
        bin_out: wp.array(dtype=wp.int32),
        place_out: wp.array(dtype=wp.vec3f),
    ):
        """The bin of each member, and that number as a place in the grid that sorts them."""
        c = columns_in[k]
        i = c.begin + first + wp.tid()
        z = cell(x[i], 2, c)
        y = cell(x[i], 1, c)
        if z % 2 == 1:
            y = c.dims[1] - 1 - y
        column = z * c.dims[1] + y
        b = cell(x[i], 0, c)
        if column % 2 == 1:
            b = c.dims[0] - 1 - b
        number = column * c.dims[0] + b
        bin_out[i] = number
        place_out[i] = wp.vec3f(float(number % 256) + 0.5, float(number / 256) + 0.5, 0.5)

    @functools.partial(register, cpu_only=True)
    def sort_by_bins(
        first: int,
        grid: wp.uint64,
        k: int,
        columns_in: wp.array(dtype=Columns),
        bins: wp.array(dtype=wp.int32),
        members: wp.array(dtype=wp.int32),
        x: wp.array(dtype=vec3),
        order_out: wp.array(dtype=wp.int32),
        planes_out: wp.array2d(dtype=real),
        starts_out: wp.array(dtype=wp.int32),
    ):
        """Slots in the order of the grid, and at which slot each bin starts."""
        c = columns_in[k]
        n = first + wp.tid()
        i = c.begin + wp.hash_grid_point_id(grid, n)
        s = c.begin + n
        order_out[s] = members[i]
        for a in range(3):
            planes_out[a, s] = x[i][a]
        before = int(-1)
        if n > 0:
            before = bins[c.begin + wp.hash_grid_point_id(grid, n - 1)]
        for b in range(before + 1, bins[i] + 1):
            starts_out[c.first + b] = s
        if s + 1 == c.end:
            for b in range(bins[i] + 1, c.dims[0] * c.dims[1] * c.dims[2] + 1):
                starts_out[c.first + b] = c.end

    return SimpleNamespace(lay=lay_columns, number=number_bins, sort=sort_by_bins)
