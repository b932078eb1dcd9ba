"""Verlet lists: when rows are made anew, and for CUDA slots in the order of a hash grid.

The grid is built in cell coordinates u = turn (x - origin), in which every cell is a unit cube.
``turn`` scales, and takes the axes in the order that has the grid's order follow the particles'
own. On a periodic axis it scales by cells / length, so that the grid's wrap by modulo is exactly
the periodicity of the box, whatever its shape. Slots (the loop's order) follow the grid's order.
The rows themselves are made in :mod:`particlesim.kernels.engine.rows`.
"""

import functools
from types import SimpleNamespace
from typing import Any

import warp as wp

from ..precision import Precision, register, structure
from .loops import Periodicity, box_type, minimum_image


def cells_type(precision: Precision) -> Any:
    """Origin and turn of a world's cell coordinates, and the first slot of the world."""
    return structure(
        f"Cells_{precision.name}",
        {"origin": precision.vec3, "turn": precision.mat33, "first": wp.int32, "world": wp.int32},
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
            "row": wp.array(dtype=wp.int64),  # block -> where its rows begin
            "cluster": wp.array(dtype=wp.int32),  # block -> first cluster
            "first": wp.array(dtype=wp.int32),  # world -> first block
            "reach_squared": wp.array2d(dtype=precision.scalar),  # block, other of its world
        },
    )


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
def cell_coordinates_kernel(precision: Precision) -> wp.Kernel:
    """Cell coordinates of points from a world's first slot on: a grid is built from, asked with."""
    vec3, Cells = precision.vec3, cells_type(precision)

    @register
    def cell_coordinates(
        first: int, cells: Cells, x: wp.array(dtype=vec3), u_out: wp.array(dtype=vec3)
    ):
        k = cells.first + first + wp.tid()
        u_out[k] = cells.turn * (x[k] - cells.origin)

    return cell_coordinates


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
        first: int,
        x_listed: wp.array(dtype=vec3),
        planes_out: wp.array2d(dtype=precision.scalar),
    ):
        """Coordinates in planes."""
        k = first + wp.tid()
        for a in range(3):
            planes_out[a, k] = x_listed[k][a]

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
        take_positions=take_positions, spread=spread, sort_slots=sort_slots
    )  # fmt: skip


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
