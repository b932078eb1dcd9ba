"""The loop over neighbours for the CPU's vector units: a cluster of slots shares its partners.

The partners of a cluster are copied once into local planes, in the periodic image that is nearest
to the cluster, and so is what a term reads of them. A loop of fixed length then serves four slots
at once from contiguous memory: nothing is gathered in it, every sum stays in registers, and a
cluster writes only its own rows, so that bits do not depend on threads. The lists that it goes over
are made in :mod:`particlesim.kernels.engine.neighbors.partners`.

Pall and Hess (2013) share partners in the same way, but in clusters on both sides; at the width of
today's vector units most pairs of such clusters are beyond the cutoff.
"""

from collections.abc import Iterator
from typing import Any

import warp as wp

from ..native import body
from ..precision import Precision, native
from ..warp_internals import array_fields, elements, native_name, numbers_in, pointed, vector
from .lanes import lane_count, row_moves
from .loops import ROWS, Pairs, Periodicity, Term, box_type

CLUSTER = 4  # slots of a cluster of a list
CROWD = 16  # slots of a cluster that looks at its whole world
TILE = 256  # partners that are copied at a time
AHEAD = 16  # entries beyond the end of all rows that are read
# Flags of the compiler by how a term may be rounded, with what it takes: the forces of a liquid in
# float32, ns a particle, of Lennard-Jones and of an energy law that is derived. As written 63 and
# 95, fused 50 and 82, in any order 49 and 64. They stay away from compensated sums; the last also
# from laws that are given, perhaps in an order that keeps them in range.
# That a law does not vectorise, as one that calls what has no vector form, is nobody's fault.
QUIET = "-Wno-pass-failed"
FUSED = f"{QUIET} -ffp-contract=fast -fno-signed-zeros"
FLAGS = {None: QUIET, "fused": FUSED, "any": f"{FUSED} -freciprocal-math -mreassociate"}
FAR = {"float": "1e30f", "double": "1e200"}


def packed_loop(
    term: Term, store: wp.Function, data: Any, params: Any, out: Any, precision: Precision,
    periodic: Periodicity, partners: str,
) -> wp.Function:  # fmt: skip
    """``loop(c, pairs, box, d, p, o)``: sum over the partners of cluster c, and store the sums.

    Rows must be contiguous (entry stride 1) and hold the cluster's own slots first. The term is
    evaluated for all, and taken by a select where it counts, so that the loop has no branch.
    """
    Box, give, vec3 = box_type(precision), term.function, precision.vec3
    total, unit = precision.vector(term.width), precision.scalar(1.0)
    numbers, arrays = _numbers(term, precision, periodic, partners == ROWS), _arrays()
    macros = _macros(term, store, list(_fields(data, precision)), precision)
    macros["TOUCH(particle)"] = " ".join(
        f"__builtin_prefetch({elements(f'o.{path}', kind)} + {width} * (long long)(particle), 1);"
        for path, kind, width in _fields(out, precision)
    )
    snippet = row_moves(precision, spare=True) + body(
        "engine/packed.cpp", precision, numbers, arrays, macros
    )

    def packed(c: int, pairs: Pairs, box: Box, d: data, p: params, o: out):
        give(0, 0, vec3(), unit, d, p)
        store(0, 0, total(), d, p, o)

    return native(packed, snippet)


def _fields(data: Any, precision: Precision, path: str = "") -> Iterator[tuple[str, str, int]]:
    """Arrays of a struct by slot: where they are, the type of their numbers, how many an entry."""
    for name, kind in array_fields(data):
        at = f"{path}.{name}" if path else name
        if wp.types.type_is_struct(kind):
            yield from _fields(kind, precision, at)
        elif kind is wp.int32:
            yield at, "int", 1
        elif numbers_in(kind, precision.scalar):
            yield at, precision.c, numbers_in(kind, precision.scalar)


def _numbers(
    term: Term, precision: Precision, periodic: Periodicity, listed: bool
) -> dict[str, Any]:
    lanes = lane_count(precision)
    return {
        "W": lanes, "OFF": CROWD, "TILE": TILE, "SIZE": CLUSTER if listed else CROWD,
        "WIDTH": term.width, "CENTRAL": term.direction is not None, "LISTED": listed,
        "PLACED": term.placed,
        "AT_ONCE": 4 if term.width <= 4 else 2,  # what registers hold
        "PERIODIC": [int(on) for on in periodic],
        "lane": list(range(lanes)),  # as wide as numbers, which a loop's counter is not
        "ASIDE": [float(each) for each in term.direction or [0.0] * term.width],
    }  # fmt: skip


def _arrays() -> dict[str, str]:
    whole = ("order", "world", "begin", "end", "lead", "count", "index")
    names = {f"int* {name}": f"pairs.{name}" for name in whole}
    return {**names, "long long* row": "pairs.row", "x": "d.x"}


def _macros(
    term: Term, store: wp.Function, fields: list[tuple[str, str, int]], precision: Precision
) -> dict[str, str]:
    lanes = lane_count(precision)
    room, copy = ["auto local = d;"], []
    for k, (path, kind, width) in enumerate(fields):
        if path.rpartition(".")[2] == "slot":  # it holds its own places
            room.append(pointed(f"local.{path}", "slots", "sizeof(int)"))
            continue
        room.append(f"alignas(64) {kind} copy{k}[{width} * (OFF + TILE) + 1];")
        room.append(pointed(f"local.{path}", f"copy{k}", f"{width} * sizeof({kind})"))
        # A vector of three as four, of which the last is the next one's, or spare.
        many = 4 if width == 3 else width
        copy.append(
            f"__builtin_memcpy(copy{k} + {width} * (to), {elements(f'd.{path}', kind)} + "
            f"{width} * (long long)(at), {many} * sizeof({kind}));"
        )
    fours = [", ".join(map(str, range(k, k + 4))) for k in range(0, lanes, 4)]
    vec = vector(3, precision.c)
    return {
        "FAR": FAR[precision.c],
        "Total": vector(term.width, precision.c),
        "CLOSEST": "p.closest_squared" if term.direction else "0",
        "ROOM": " ".join(room),
        "COPY(to, at)": " ".join(copy),
        "GIVE(i, j, dx, dy, dz, r2)":
            f"{native_name(term.function)}(i, j, {vec}(dx, dy, dz), r2, local, p)",
        "STORE(slot, total)": f"{native_name(store)}(slot, order[slot], total, d, p, o);",
        "STORES": '_Pragma("clang loop vectorize(assume_safety) vectorize_width(4)")'
            if term.stored_in_line else "",
        "IN_FOURS(v)": " + ".join(f"__builtin_shufflevector(v, v, {each})" for each in fours),
    }  # fmt: skip
