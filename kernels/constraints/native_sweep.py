"""The sweep over the tuples of a colour in C++, for the vector units of a CPU."""

from collections.abc import Iterable

import warp as wp

from ..engine.lanes import lane_count, row_moves
from ..engine.loops import box_type
from ..precision import native
from ..warp_internals import elements, native_name, vector
from ..warp_native import entry, matrix, numbers
from .constraints import Solved, positions_type, shift_function
from .correction import evaluate_function, multiply_function


def group(law: Solved) -> int:
    """Tuples that go together: two vectors, so that while one waits for its divisions the other one
    works.
    """
    return 2 * lane_count(law.precision)


def native_sweep(law: Solved) -> wp.Function:
    """The same as ``plain_sweep``, of whole groups of tuples.

    Rows come to planes, a group of tuples is corrected at once, and planes go back to rows.
    """
    real, Box, Tuples, Bodies = law.types
    size, c, vec3 = law.size, law.precision.c, law.precision.vec3
    evaluate, multiply = evaluate_function(law), multiply_function(law)
    shift = shift_function(law.precision, law.compensated)
    positions, weights = positions_type(law.precision, size), law.precision.vector(size)
    moved = {"x": "x", "c": "correction"} | ({"e": "x_error"} if law.compensated else {})
    read = moved | {"v": "v"}

    def rows(move: str, fields: dict[str, str]) -> str:
        """Rows of all particles number ``a``, from or to planes."""
        return " ".join(
            f"{move}({elements(f'b.{array}', c)}, id + {size} * h + a, {size}, "
            f"&{name}_of[a][0][h], tuples);"
            for name, array in fields.items()
        )

    columns = {"id": ("particle", "int"), "item": ("item", "Item"), "lam": ("lam", c)}
    columns |= {"world": ("world", "int")} if law.periodic else {}
    columns |= {"broken": ("broken", "int")} if law.breakable else {}
    pointers = " ".join(
        f"{kind}* {name} = {elements(f't.{array}', kind)} + {size if name == 'id' else 1} * r;"
        for name, (array, kind) in columns.items()
    )
    snippet = f"""{row_moves(law.precision)}
    const int lanes = {lane_count(law.precision)}, tuples = {group(law)};
    typedef __typeof__(*t.item.data) Item;
    const {c}* inverse_mass = {elements("b.w", c)};
    alignas(64) {c} {", ".join(f"{name}_of[{size}][3][tuples]" for name in [*read, "G", "H"])};
    alignas(64) {c} w_of[{size}][tuples], lam_of[tuples], C_of[tuples], extent_of[tuples];
    for (int r = first; r < last; r += tuples) {{
        {pointers}
        for (int a = 0; a < {size}; ++a) {{
            for (int h = 0; h < tuples; h += lanes) {{ {rows("fetch", read)} }}
            for (int l = 0; l < tuples; ++l) w_of[a][l] = inverse_mass[id[{size} * l + a]];
        }}
        {_lane_loops(law, moved, read)}
        for (int l = 0; l < tuples; ++l) lam[l] = lam_of[l];
        for (int a = 0; a < {size}; ++a)
            for (int h = 0; h < tuples; h += lanes) {{ {rows("put", moved)} }}
    }}
"""

    def sweep_natively(
        first: int, last: int, fresh: int, box: wp.array(dtype=Box), t: Tuples, b: Bodies,
        dt: real, inverse_dt: real,
    ):  # fmt: skip
        p = positions()
        q = t.item[first]
        evaluate(p, p, p, p, q, Box(), dt)
        multiply(dt, p, p, dt, weights(), dt, q, dt, dt, dt)
        shift(vec3(), vec3(), vec3(), vec3())

    return native(sweep_natively, snippet)


def _lane_loops(law: Solved, moved: Iterable[str], read: Iterable[str]) -> str:
    """C++: one tuple a lane, evaluated and then corrected.

    In two loops, as there are laws whose evaluation the compiler does not vectorise.
    """
    size, c = law.size, law.precision.c
    evaluate, multiply = native_name(evaluate_function(law)), native_name(multiply_function(law))

    def planes(names: Iterable[str]) -> list[tuple[str, str]]:
        """The entries of matrices, and where they are in their planes."""
        entries = [(n, a, k) for n in names for a in range(size) for k in range(3)]
        return [(entry(n, a, k), f"{n}_of[{a}][{k}][l]") for n, a, k in entries]

    # Structs number by number: as a whole they would be vectors, which no lane can hold. All of
    # them at once: a loop that leaves some out could not take its last lanes together.
    fields = [(f"q_of[{n}][l]", each) for n, each in enumerate(numbers(law.item))]
    item = [(f"q.{each}", place) for place, each in fields]
    seen = [*planes(read), *item]
    if law.periodic:
        box = numbers(box_type(law.precision))
        seen += [(f"B.{each}", f"box.data[world[l]].{each}") for each in box]
    known = [
        *planes("GH"),
        *item,
        *((f"w[{a}]", f"w_of[{a}][l]") for a in range(size)),
    ]
    if law.breakable:  # without weight it does not move
        known += [(f"w[{a}]", f"broken[l] ? ({c})0 : w[{a}]") for a in range(size)]
    return f"""
        alignas(64) {c} q_of[{len(fields)}][tuples];
        for (int l = 0; l < tuples; ++l) {{ {_copied((to, f"item[l].{of}") for to, of in fields)} }}
#pragma clang loop interleave_count(2)
        for (int l = 0; l < tuples; ++l) {{
            {matrix(size, 3, c)} x, e, c, v, G, H;
            Item q;
            __typeof__(*box.data) B;
            {_copied(seen)}
            {evaluate}(x, e, c, v, q, B, dt, C_of[l], G, H, extent_of[l]);
            {_copied((of, to) for to, of in planes("GH"))}
        }}
#pragma clang loop interleave_count(2)
        for (int l = 0; l < tuples; ++l) {{
            {matrix(size, 3, c)} G, H, D;
            {vector(size, c)} w;
            Item q;
            const {c} lam_old = fresh ? 0 : lam[l];
            {c} lam_new;
            bool good;
            {_copied(known)}
            {multiply}(C_of[l], G, H, extent_of[l], w, lam_old, q, b.unit, b.most, inverse_dt,
                lam_new, good, D);
            lam_of[l] = good ? lam_new : lam_old;
            {" ".join(_moved(law, moved, a) for a in range(size))}
        }}
"""


def _moved(law: Solved, names: Iterable[str], a: int) -> str:
    """C++: particle ``a`` goes on, if that is good."""
    shift = native_name(shift_function(law.precision, law.compensated))
    places = [(n, k, f"{n}_of[{a}][{k}][l]") for n in names for k in range(3)]
    return f"""{{
            {vector(3, law.precision.c)} x, e, c, dx, x_new, e_new, c_new;
            {_copied((f"{n}[{k}]", place) for n, k, place in places)}
            {_copied((f"dx[{k}]", entry("D", a, k)) for k in range(3))}
            {shift}(x, e, c, dx, x_new, e_new, c_new);
            {_copied((place, f"good ? {n}_new[{k}] : {n}[{k}]") for n, k, place in places)}
            }}"""


def _copied(pairs: Iterable[tuple[str, str]]) -> str:
    return " ".join(f"{to} = {of};" for to, of in pairs)
