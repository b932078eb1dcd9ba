"""Partners of clusters on a CPU: the rows of a list, sixteen candidates at a time."""

import functools

import warp as wp

from ...native import body
from ...precision import Precision, native, register
from ...warp_internals import columns
from ..loops import Pairs, Periodicity, box_type
from ..packed import CLUSTER
from .clusters import supers_type
from .columns import SUPER, columns_type
from .renewal import blocks_type

RUNS = 256  # of slots that one super looks at; if there are more it looks at all
LEAST = 8  # entries that are written at once
ROUNDED = 4  # entries that the rooms of rows are rounded up to
HERE = 512  # entries of a row while it is made; of a longer one the pool holds what it had before
MARGIN = 0.02  # of a cell, for the rounding of cells


def _lanes(mask: int) -> int:
    """The lanes of the bits that are set in a mask of eight, one byte each, lowest first."""
    return sum(lane << (8 * k) for k, lane in enumerate(b for b in range(8) if mask >> b & 1))


@wp.struct
class Pool:
    """Where the rows of each world are: entries of the index, from each one's first."""

    first: wp.array(dtype=wp.int64)  # world -> first entry, and at the end one more
    taken: wp.array(dtype=wp.int32)  # world -> entries in use, or wanted where it was full
    most: wp.array(dtype=wp.int32)  # world -> at most so many in any earlier rows


def _look(precision: Precision, periodic: Periodicity, own: bool) -> wp.Function:
    """``look(q, w, ...)``: make the rows of the clusters of super q."""
    Box, Columns, Supers, Blocks = (
        box_type(precision), columns_type(precision), supers_type(precision),
        blocks_type(precision),
    )  # fmt: skip
    numbers = {
        "SUPER": SUPER, "CLUSTER": CLUSTER, "CLUSTERS": SUPER // CLUSTER, "LEAST": LEAST,
        "ROUNDED": ROUNDED, "HERE": HERE, "RUNS": RUNS, "PERIODIC": [int(on) for on in periodic],
        "OWN": int(own),
    }  # fmt: skip
    arrays = {
        "px": "x", "middle": "supers.middle", "half": "supers.half",
        "reach_squared": "blocks.reach_squared", "int* super_first": "supers.first",
        "int* leads": "supers.lead", "int* block_of": "supers.block",
        "int* cluster_of": "supers.cluster", "int* block_begin": "blocks.begin",
        "int* block_end": "blocks.end",
        "int* world_first": "blocks.first", "int* starts": "starts_in",
        "int* index": "pairs.index", "int* count": "pairs.count", "long long* row": "pairs.row",
        "long long* pool": "rows.first", "int* taken": "rows.taken",
        "int* found": "found_out", "int* overflowed": "overflow",
    }  # fmt: skip
    macros = {
        "MARGIN": f"((real){MARGIN})", "stride": f"((long long){columns('x')})",
        "supers_n": f"((long long){columns('supers.middle')})",
        "blocks_n": columns("blocks.reach_squared"), "layout": "columns.data",
    }  # fmt: skip
    lanes = ", ".join(f"{_lanes(mask):#x}ull" for mask in range(256))
    table = f"static const unsigned long long LANES[256] = {{{lanes}}};\n"
    snippet = table + body("engine/neighbors/partners.cpp", precision, numbers, arrays, macros)

    def look(
        q: int, w: int, box: Box, blocks: Blocks, columns: wp.array(dtype=Columns),
        starts_in: wp.array(dtype=wp.int32), supers: Supers, rows: Pool,
        x: wp.array2d(dtype=precision.scalar), pairs: Pairs, found_out: wp.array(dtype=wp.int32),
        overflow: wp.array(dtype=wp.int32),
    ): ...  # fmt: skip

    return native(look, snippet, after_gradients=False)


@functools.cache
def partners_kernel(precision: Precision, periodic: Periodicity, own: bool = False) -> wp.Kernel:
    """Kernel: for every super of a world that has moved, the rows of its clusters.

    ``own``: particles have reaches of their own, in the planes behind the others.
    """
    real, Box, Blocks = precision.scalar, box_type(precision), blocks_type(precision)
    Columns, Supers = columns_type(precision), supers_type(precision)
    look = _look(precision, periodic, own)

    @functools.partial(register, cpu_only=True)
    def find_partners(
        first: int,
        moved: wp.array(dtype=wp.int32),
        box: wp.array(dtype=Box),
        blocks: Blocks,
        columns_in: wp.array(dtype=Columns),
        starts_in: wp.array(dtype=wp.int32),
        supers: Supers,
        rows: Pool,
        x: wp.array2d(dtype=real),
        pairs: Pairs,
        found_out: wp.array(dtype=wp.int32),
        overflow: wp.array(dtype=wp.int32),
    ):
        q = first + wp.tid()
        w = pairs.world[supers.lead[q]]
        if moved[w] != 0:
            look(
                q, w, box[w], blocks, columns_in, starts_in, supers, rows, x, pairs, found_out,
                overflow,
            )  # fmt: skip

    return find_partners


@functools.cache
def pools_kernel() -> wp.Kernel:
    """Kernel: nothing is in the pools of the worlds that have moved."""

    @functools.partial(register, cpu_only=True)
    def empty_pools(first: int, moved: wp.array(dtype=wp.int32), rows_out: Pool):
        w = first + wp.tid()
        if moved[w] != 0:
            rows_out.most[w] = wp.max(rows_out.most[w], rows_out.taken[w])
            rows_out.taken[w] = 0

    return empty_pools
