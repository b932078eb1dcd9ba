"""Verlet lists: when rows are made anew, and for CUDA slots in the order of a hash grid.

The grid is built in cell coordinates u = turn (x - origin), in which every cell is a unit cube.
``turn`` scales, and takes the axes in the order that has the grid's order follow the particles'
own. On a periodic axis it scales by cells / length, so that the grid's wrap by modulo is exactly
the periodicity of the box, whatever its shape. Slots (the loop's order) follow the grid's order.

Where a barostat scales the boxes (``flexible``), rows are made in a box that stays as it was then:
positions since are compared with where that scaling alone would have taken them.
The rows themselves are made in :mod:`particlesim.kernels.engine.neighbors.rows`.
"""

import functools
from types import SimpleNamespace
from typing import Any

import warp as wp

from ...precision import Precision, function, native, register, structure
from ...warp_internals import elements
from ..atomics import rise_function
from ..loops import Periodicity, box_type, minimum_image


def cells_type(precision: Precision) -> Any:
    """Origin and turn of a world's cell coordinates, and the first slot of the world.

    ``length`` are the lengths of the box that they are for, 0 on open axes.
    """
    fields = {
        "origin": precision.vec3, "turn": precision.mat33, "first": wp.int32, "world": wp.int32,
        "length": precision.vec3,
    }  # fmt: skip
    return structure(f"Cells_{precision.name}", fields)


def scaled_function(precision: Precision, flexible: bool) -> wp.Function:
    """``scaled(x, then, now)``: where a point is taken to by a box that is scaled."""
    vec3, Box = precision.vec3, box_type(precision)

    def scaled(x: vec3, then: Box, now: Box):
        result = x
        if wp.static(flexible):
            result = now.lower + wp.cw_mul(x - then.lower, wp.cw_mul(now.length, then.inverse))
        return result

    return function(scaled)


def blocks_type(precision: Precision) -> Any:
    """The blocks of all worlds: their slots, how far they reach, and the room in their rows."""
    return structure(
        f"Blocks_{precision.name}",
        {
            "of": wp.array(dtype=wp.int32),  # slot -> block
            "begin": wp.array(dtype=wp.int32),  # block -> first slot
            "end": wp.array(dtype=wp.int32),  # block -> last slot + 1
            "room": wp.array(dtype=wp.int32),  # block -> entries of a row, on CUDA
            "first": wp.array(dtype=wp.int32),  # world -> first block
            "cutoff": wp.array2d(dtype=wp.float64),  # block, other of its world
            "reach_squared": wp.array2d(dtype=precision.scalar),  # the same, with the skin
        },
    )


BLOCK = 64  # slots that a thread of the CPU looks at


@functools.cache
def moved_kernel(
    precision: Precision, periodic: Periodicity, flexible: bool, block: int = 1
) -> wp.Kernel:
    """Flag each world in which a slot has moved further than its margin (half the skin).

    A thread looks at ``block`` slots.
    """
    vec3, real, Box = precision.vec3, precision.scalar, box_type(precision)
    image, scaled = minimum_image(precision, periodic), scaled_function(precision, flexible)
    stayed = _stayed(precision, periodic, flexible)

    @functools.partial(register, cpu_only=block > 1)
    def flag_moved(
        first: int,
        members: wp.array(dtype=wp.int32),
        world: wp.array(dtype=wp.int32),
        box: wp.array(dtype=Box),
        box_listed: wp.array(dtype=Box),
        margin_squared: wp.array(dtype=real),
        x: wp.array(dtype=vec3),
        x_listed: wp.array(dtype=vec3),
        moved: wp.array(dtype=wp.int32),
        any_moved: wp.array(dtype=wp.int32),
    ):
        begin = (first + wp.tid()) * wp.static(block)
        end = wp.min(begin + wp.static(block), members.shape[0])
        if wp.static(block > 1):
            still = stayed(begin, end, members, world, box, box_listed, margin_squared, x, x_listed)
            if still != 0:
                end = begin
        for k in range(begin, end):
            w = world[k]
            there = scaled(x_listed[k], box_listed[w], box[w])
            d = image(x[members[k]] - there, box[w])
            if wp.dot(d, d) > margin_squared[w]:
                # Every writer writes the same, and once: threads would fight over the cache line.
                if moved[w] == 0:
                    moved[w] = 1
                if any_moved[0] == 0:
                    any_moved[0] = 1

    return flag_moved


def _stayed(precision: Precision, periodic: Periodicity, flexible: bool) -> wp.Function:
    """``stayed(begin, end, ...)``: 1 if it is quickly seen that none of these slots has moved far.

    It is where they are of one world, and particles that follow each other.
    """
    vec3, Box, c = precision.vec3, box_type(precision), precision.c
    nearest = " ".join(
        f"d[{a}] -= b.length[{a}] * __builtin_elementwise_rint(d[{a}] * b.inverse[{a}]);"
        for a, on in enumerate(periodic)
        if on
    )
    there = "then[3 * k + a]"
    if flexible:
        there = f"(b.lower[a] + ({there} - o.lower[a]) * (b.length[a] * o.inverse[a]))"
    snippet = f"""
    const int *all = {elements("members", "int")} + begin, i = all[0];
    const int w = {elements("world", "int")}[begin];
    int apart = {elements("world", "int")}[end - 1] - w;
    for (int k = 0; k < end - begin; ++k) apart |= all[k] - i - k;
    if (apart) return 0;
    const auto b = box.data[w], o = box_listed.data[w];
    const {c} margin = {elements("margin_squared", c)}[w];
    const {c}* now = {elements("x", c)} + 3 * (long long)i;
    const {c}* then = {elements("x_listed", c)} + 3 * (long long)begin;
    int far = 0;
    for (int k = 0; k < end - begin; ++k) {{
        {c} d[3];
        for (int a = 0; a < 3; ++a) d[a] = now[3 * k + a] - {there};
        {nearest}
        far |= d[0] * d[0] + d[1] * d[1] + d[2] * d[2] > margin;
    }}
    return !far;
"""

    def stayed(
        begin: int, end: int, members: wp.array(dtype=wp.int32), world: wp.array(dtype=wp.int32),
        box: wp.array(dtype=Box), box_listed: wp.array(dtype=Box),
        margin_squared: wp.array(dtype=precision.scalar), x: wp.array(dtype=vec3),
        x_listed: wp.array(dtype=vec3),
    ) -> int: ...  # fmt: skip

    return native(stayed, snippet, after_gradients=False)


@functools.cache
def among_kernel() -> wp.Kernel:
    """Kernel over worlds: those that are not among the chosen keep their rows."""

    @register
    def keep_rows(first: int, chosen: wp.array(dtype=wp.int32), moved_io: wp.array(dtype=wp.int32)):
        w = first + wp.tid()
        if chosen[w] == 0:
            moved_io[w] = 0

    return keep_rows


@functools.cache
def positions_kernel(precision: Precision, periodic: Periodicity, flexible: bool) -> wp.Kernel:
    """Kernel: positions that rows are made from, and how far they are from the last ones."""
    vec3, Box, image = precision.vec3, box_type(precision), minimum_image(precision, periodic)
    rise, scaled = rise_function(), scaled_function(precision, flexible)

    @register
    def take_positions(
        first: int,
        members: wp.array(dtype=wp.int32),
        world: wp.array(dtype=wp.int32),
        box: wp.array(dtype=Box),
        box_listed: wp.array(dtype=Box),
        moved: wp.array(dtype=wp.int32),
        x: wp.array(dtype=vec3),
        x_listed_io: wp.array(dtype=vec3),
        farthest_squared: wp.array(dtype=wp.float32),
    ):
        k = first + wp.tid()
        w = world[k]
        if moved[w] != 0:
            now = x[members[k]]
            d = image(now - scaled(x_listed_io[k], box_listed[w], box[w]), box[w])
            rise(w, wp.float32(wp.dot(d, d)), farthest_squared)
            x_listed_io[k] = now

    return take_positions


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
def sorting_kernels(precision: Precision) -> SimpleNamespace:
    """Kernels for CUDA around a build that do not look at pairs."""
    vec3, Cells = precision.vec3, cells_type(precision)

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

    return SimpleNamespace(spread=spread, sort_slots=sort_slots)


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
