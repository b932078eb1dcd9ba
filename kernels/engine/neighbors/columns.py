"""Columns: slots in an order in which those that follow each other are near each other.

Cells whose side holds about sixteen particles are cut along one axis into bins. The columns of bins
follow each other like the furrows of a field, so that sixteen slots are close together wherever
they begin. ``wp.HashGrid`` sorts, by a number for each bin; the columns are laid anew over what a
block fills at every build.
"""

import functools
from typing import Any

import warp as wp

from ...precision import Precision, function, register, structure
from ..loops import box_type

SUPER = 16  # slots that are halved together, and that a cell holds
BINS = 8  # of a column, on the length of its side
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


def _sizes(precision: Precision) -> tuple[wp.Function, wp.Function]:
    """``side_of(spread, count, longest)`` of columns, and ``dims_of(length, side, c)``."""
    vec3, real, Columns = precision.vec3, precision.scalar, columns_type(precision)
    bins, held = real(BINS), real(SUPER)

    def side_of(spread: vec3, count: real, longest: real):
        """With it what is spread evenly has one cell for each sixteen."""
        side = wp.where(longest > real(0.0), longest, real(1.0))
        for _n in range(200):
            cells = (spread[0] / side + real(1.0)) * (spread[1] / side + real(1.0))
            if cells * (spread[2] / side + real(1.0)) * held >= count:
                break
            side = side * real(0.9)
        return side

    def dims_of(length: vec3, side: real, c: Columns):
        """Whole columns fill a periodic axis; an open one is covered."""
        n = wp.vec3i(1, 1, 1)
        width = vec3(side / bins, side, side)
        for a in range(3):
            # At most what there is room for: how many it is may be beyond whole numbers.
            k = int(wp.min(wp.floor(length[a] / width[a]), real(c.most)))
            n[a] = wp.where(c.wraps[a] != 0, wp.max(k, 1), k + 1)
        return n

    return function(side_of), function(dims_of)


@functools.cache
def lay_kernel(precision: Precision) -> wp.Kernel:
    """Kernel: lay the columns of one block over what it fills."""
    vec3, real, Box = precision.vec3, precision.scalar, box_type(precision)
    Columns, (side_of, dims_of) = columns_type(precision), _sizes(precision)
    bins = real(BINS)

    @functools.partial(register, cpu_only=True)
    def lay_columns(
        first: int,
        block: int,
        box: wp.array(dtype=Box),
        x: wp.array(dtype=vec3),
        columns_io: wp.array(dtype=Columns),
    ):
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
        for a in range(3):
            b = c.axes[a]
            m = mean[b] / count
            # An even spread over a length L has the variance L^2 / 12; outliers count for little.
            spread[a] = wp.sqrt(real(12.0) * wp.max(square[b] / count - m * m, real(0.0)))
            length[a] = wp.where(c.wraps[a] != 0, box[c.world].length[b], high[b] - low[b])
            lower[a] = wp.where(c.wraps[a] != 0, box[c.world].lower[b], low[b])
            if not wp.isfinite(spread[a]):
                spread[a] = real(0.0)
            if not wp.isfinite(length[a]):  # wherever they are, it ends somewhere
                length[a] = real(0.0)
                lower[a] = real(0.0)
        side = side_of(spread, count, wp.max(length))
        n = dims_of(length, side, c)
        while real(n[0]) * real(n[1]) * real(n[2]) > real(c.most):
            side = side * real(1.1)
            n = dims_of(length, side, c)
        scale = vec3(bins, real(1.0), real(1.0)) / side
        for a in range(3):
            if c.wraps[a] != 0:
                scale[a] = real(n[a]) / length[a]
        columns_io[k].lower = lower
        columns_io[k].scale = scale
        columns_io[k].dims = n

    return lay_columns


@functools.cache
def number_kernel(precision: Precision) -> wp.Kernel:
    """Kernel: the bin of each member of a block, and as a place in the grid that sorts them."""
    vec3, Columns = precision.vec3, columns_type(precision)

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
        place_out[i] = wp.vec3f(float(number % LINE) + 0.5, float(number / LINE) + 0.5, 0.5)

    return number_bins


@functools.cache
def sort_kernel(precision: Precision) -> wp.Kernel:
    """Kernel: slots in the order of the grid, and at which slot each bin starts."""
    vec3, real, Columns = precision.vec3, precision.scalar, columns_type(precision)

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

    return sort_by_bins
