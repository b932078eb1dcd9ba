"""Rows of neighbours where a barostat scales the boxes.

Rows are made in a box that stays as it was then. Two of which the distance was c + s, the cutoff
and the skin, are S (c + s) from each other by a scaling by S alone.
"""

import functools

import warp as wp

from ...precision import Precision, function, register
from ..loops import box_type
from .renewal import cells_type
from .skin import HALF, Skins


@functools.cache
def boxes_kernel(precision: Precision) -> wp.Kernel:
    """Kernel over worlds: the boxes that rows are made in."""
    Box = box_type(precision)

    @register
    def take_boxes(
        first: int,
        moved: wp.array(dtype=wp.int32),
        box: wp.array(dtype=Box),
        box_listed_io: wp.array(dtype=Box),
    ):
        w = first + wp.tid()
        if moved[w] != 0:
            box_listed_io[w] = box[w]

    return take_boxes


@functools.cache
def margin_kernel(precision: Precision) -> wp.Kernel:
    """Kernel over worlds: how far slots may move once boxes have been scaled.

    Each of two may come nearer by half of what S (c + s) has beyond c.
    """
    real, Box = precision.scalar, box_type(precision)

    @register
    def set_margins(
        first: int,
        box: wp.array(dtype=Box),
        box_listed: wp.array(dtype=Box),
        cutoff: wp.array(dtype=wp.float64),
        skins: Skins,
        margins_io: wp.array2d(dtype=real),
    ):
        w = first + wp.tid()
        S = wp.float64(box[w].length[0]) / wp.float64(box_listed[w].length[0])
        thick = skins.thickness[w]
        beyond = thick + wp.min(S - wp.float64(1.0), wp.float64(0.0)) * (cutoff[w] + thick)
        half = wp.float64(HALF) * beyond
        for phase in range(2):
            if margins_io[phase, w] != real(wp.inf):
                margins_io[phase, w] = real(wp.sign(half) * half * half)

    return set_margins


def cell_function(precision: Precision, flexible: bool) -> wp.Function:
    """``cell(x, cells, box)``: cell coordinates of a point."""
    vec3, Box, Cells = precision.vec3, box_type(precision), cells_type(precision)

    def cell_coordinate(x: vec3, cells: Cells, box: Box):
        y = x
        if wp.static(flexible):  # as if the box were that of the cells
            y = box.lower + wp.cw_mul(x - box.lower, wp.cw_mul(cells.length, box.inverse))
        return cells.turn * (y - cells.origin)

    return function(cell_coordinate)


@functools.cache
def scaled_cells_kernel(precision: Precision) -> wp.Kernel:
    """The same in a box that has been scaled since the grid was made."""
    vec3, Cells, Box = precision.vec3, cells_type(precision), box_type(precision)
    cell = cell_function(precision, flexible=True)

    @register
    def scaled_cells(
        first: int, cells: Cells, box: wp.array(dtype=Box), x: wp.array(dtype=vec3),
        u_out: wp.array(dtype=vec3),
    ):  # fmt: skip
        k = cells.first + first + wp.tid()
        u_out[k] = cell(x[k], cells, box[cells.world])

    return scaled_cells
