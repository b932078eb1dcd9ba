"""The loops over neighbours: one skeleton into which every pair term is plugged.

A *term* is a Warp function ``term(i, j, x_ij, r2, d, p) -> vector`` of what particle j contributes
to particle i. It reads per-particle arrays from the struct ``d`` (which always holds the positions
``x``) and parameters from the struct ``p`` (which always holds ``cutoff_squared``). The loop sums
the terms over the pairs within the cutoff; a coincident pair, r = 0, reaches the term as it is.

Two builders make the same function: :func:`native_loop` for the CPU, where a C++ loop that
reassociates the sum lets the compiler use the vector units (Warp's own loops never do), and
:func:`plain_loop`, the reference, for CUDA.
"""

import functools
from dataclasses import dataclass
from typing import Any

import warp as wp

from ..precision import Precision, function, native, structure
from ..warp_internals import elements, native_name, vector

# Where the partners of slot i are: a row of a neighbour list, or the whole range of i's world.
ROWS = "rows"
ALL = "all"


@dataclass(frozen=True)
class Periodicity:
    """Which axes are periodic; none leaves the minimum image out of the compiled code."""

    x: bool = False
    y: bool = False
    z: bool = False

    def __iter__(self):
        return iter((self.x, self.y, self.z))

    def __bool__(self) -> bool:
        return self.x or self.y or self.z


@wp.struct
class Pairs:
    """Partners of every slot: list rows, or ranges. Slots are particles in the loop's own order."""

    order: wp.array(dtype=wp.int32)  # slot -> particle
    world: wp.array(dtype=wp.int32)  # slot -> world
    begin: wp.array(dtype=wp.int32)  # world -> first slot
    end: wp.array(dtype=wp.int32)  # world -> last slot + 1
    count: wp.array(dtype=wp.int32)  # slot -> entries of its row
    row: wp.array(dtype=wp.int64)  # slot -> where its row begins
    index: wp.array(dtype=wp.int32)  # the rows, slots
    entry_stride: wp.int64


def box_type(precision: Precision) -> Any:
    """Periodic box of a world: side lengths and their inverses, 0 on open axes."""
    fields = {k: precision.vec3 for k in ("lower", "length", "inverse")}
    return structure(f"Box_{precision.name}", fields)


def minimum_image(precision: Precision, periodic: Periodicity) -> wp.Function:
    """d - L round(d / L) on the periodic axes.

    Rounding half to even is odd: two particles half a box apart see each other in opposite
    directions.
    """
    vec3, Box = precision.vec3, box_type(precision)
    on_x, on_y, on_z = (int(axis) for axis in periodic)

    def nearest_image(d: vec3, box: Box):
        result = d
        if wp.static(on_x):
            result[0] = d[0] - box.length[0] * wp.rint(d[0] * box.inverse[0])
        if wp.static(on_y):
            result[1] = d[1] - box.length[1] * wp.rint(d[1] * box.inverse[1])
        if wp.static(on_z):
            result[2] = d[2] - box.length[2] * wp.rint(d[2] * box.inverse[2])
        return result

    return function(nearest_image)


def native_image(precision: Precision, periodic: Periodicity) -> str:
    """The same in C++, of the numbers ``dx``, ``dy`` and ``dz`` and the struct ``box``."""
    rint = "__builtin_rintf" if precision.c == "float" else "__builtin_rint"
    return "\n".join(
        f"d{axis} -= box.length[{n}] * {rint}(d{axis} * box.inverse[{n}]);"
        for n, (axis, on) in enumerate(zip("xyz", periodic, strict=True))
        if on
    )


@functools.cache
def reader(precision: Precision, width: int | None = None) -> wp.Function:
    """``read(array, j)`` of numbers, or of vectors by their components, from an array without gaps.

    Warp's own reading computes with strides and loads a vector as a whole; the first slows a
    vectorised loop, the second keeps the compiler from vectorising it.
    """
    real = precision.c
    if width is None:
        kind, body = precision.scalar, "data[j]"
    else:
        kind = precision.vector(width)
        components = ", ".join(f"data[{width} * (long long)j + {c}]" for c in range(width))
        body = f"{vector(width, real)}({components})"
    snippet = f"""
    const {real}* data = {elements("array", real)};
    return {body};
"""

    def read(array: wp.array(dtype=kind), j: int) -> kind: ...

    return native(read, snippet, after_gradients=False)


def plain_loop(
    term: wp.Function, data: Any, params: Any, width: int, precision: Precision,
    periodic: Periodicity, partners: str,
) -> wp.Function:  # fmt: skip
    """The loop in Warp's own language: ``loop(i, pairs, box, d, p) -> vector(width)``."""
    Box, total = box_type(precision), precision.vector(width)
    image = minimum_image(precision, periodic)

    rows = partners == ROWS

    def plain_sum(i: int, pairs: Pairs, box: Box, d: data, p: params):
        x_i = d.x[i]
        result = total()
        row = wp.int64(0)
        if wp.static(rows):
            row = pairs.row[i]
            first = 0
            last = pairs.count[i]
        else:
            first = pairs.begin[pairs.world[i]]
            last = pairs.end[pairs.world[i]]
        for k in range(first, last):
            j = k
            if wp.static(rows):
                j = pairs.index[row + wp.int64(k) * pairs.entry_stride]
            x_ij = image(x_i - d.x[j], box)
            r2 = wp.dot(x_ij, x_ij)
            if j != i and r2 < p.cutoff_squared:
                result += term(i, j, x_ij, r2, d, p)
        return result

    return function(plain_sum, after_gradients=True)


_HEAD = {
    ROWS: f"""
    const int first = 0, last = {elements("pairs.count", "int")}[i];
    const int* row = {elements("pairs.index", "int")} + {elements("pairs.row", "long long")}[i];""",
    ALL: f"""
    const int w = {elements("pairs.world", "int")}[i];
    const int first = {elements("pairs.begin", "int")}[w], last = {elements("pairs.end", "int")}[w];
""",
}
_PARTNER = {ROWS: "row[{}]", ALL: "{}"}
_INSIDE = {ROWS: "r2 < p.cutoff_squared", ALL: "(j != i) & (r2 < p.cutoff_squared)"}


def native_loop(
    term: wp.Function, data: Any, params: Any, width: int, precision: Precision,
    periodic: Periodicity, partners: str,
) -> wp.Function:  # fmt: skip
    """The same loop as a C++ snippet that vectorises.

    Outside the cutoff the term is evaluated at a harmless distance and multiplied away by a
    select, so the loop has no branch of its own. Rows must be contiguous (entry stride 1).

    The term is called once before, for nothing but what it reads of i, which the compiler then
    keeps: within the loop, where it is called only inside the cutoff, a read may not be moved.
    """
    real, Box, total = precision.c, box_type(precision), precision.vector(width)
    unit, vec3, sums = precision.scalar(1.0), precision.vec3, range(width)
    call, partner, vec = native_name(term), _PARTNER[partners].format, vector(3, real)
    snippet = f"""{_HEAD[partners]}
    const {real}* x = {elements("d.x", real)};
    const {real} xi = x[3*i], yi = x[3*i+1], zi = x[3*i+2];
    {"".join(f"{real} sum{s} = 0; " for s in sums)}
    if (first < last) {{
#pragma clang fp reassociate(on) contract(fast)
    {call}(i, {partner("first")}, {vec}(1, 0, 0), 1, d, p);
#pragma clang loop vectorize(enable)
    for (int k = first; k < last; ++k) {{
        const int j = {partner("k")};
        {real} dx = xi - x[3*j], dy = yi - x[3*j+1], dz = zi - x[3*j+2];
        {native_image(precision, periodic)}
        const {real} r2 = dx*dx + dy*dy + dz*dz;
        const bool inside = {_INSIDE[partners]};
        const {real} safe = inside ? r2 : ({real})1;
        const {vector(width, real)} t = {call}(i, j, {vec}(dx, dy, dz), safe, d, p);
        {"".join(f"sum{s} += inside ? t[{s}] : ({real})0; " for s in sums)}
    }}
    }}
    {vector(width, real)} result;
    {"".join(f"result[{s}] = sum{s}; " for s in sums)}
    return result;
"""

    def native_sum(i: int, pairs: Pairs, box: Box, d: data, p: params) -> total:
        term(i, i, vec3(), unit, d, p)

    return native(native_sum, snippet)
