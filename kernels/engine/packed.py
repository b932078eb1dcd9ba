"""The loop over neighbours for the CPU's vector units: a cluster of slots shares its partners.

The partners of a cluster are copied once into local planes, in the periodic image that is nearest
to the cluster, and so is what a term reads of them. A loop of fixed length then serves four slots
at once from contiguous memory: nothing is gathered in it, every sum stays in registers, and a
cluster writes only its own rows, so that bits do not depend on threads. The lists that it goes over
are made in :mod:`particlesim.kernels.engine.clusters`.

Pall and Hess (2013) share partners in the same way, but in clusters on both sides; at the width of
today's vector units most pairs of such clusters are beyond the cutoff.
"""

from collections.abc import Iterator
from typing import Any

import warp as wp

from ..precision import Precision, native
from ..warp_internals import array_fields, elements, native_name, numbers_in, pointed, vector
from .loops import ROWS, Pairs, Periodicity, Term, box_type, native_image

CLUSTER = 4  # slots of a cluster of a list
CROWD = 16  # slots of a cluster that looks at its whole world
TILE = 256  # partners that are copied at a time
AHEAD = 16  # entries beyond the end of a row, and floats beyond that of positions, that are read
# Flags of the compiler by how a term may be rounded, with what it takes to sum a Lennard-Jones
# liquid in float32: 80 ns a particle as written, 61 fused. A derived energy takes 95, 81 and in any
# order 60. They stay away from compensated sums, and from laws that are given in an order that
# keeps them in range.
FUSED = "-ffp-contract=fast -freciprocal-math -fno-signed-zeros"
FLAGS = {None: "", "fused": FUSED, "any": f"{FUSED} -mreassociate"}
FAR = {"float": "1e30f", "double": "1e200"}  # its square is infinite, and 0 times it is 0


def packed_loop(
    term: Term, store: wp.Function, data: Any, params: Any, out: Any, precision: Precision,
    periodic: Periodicity, partners: str,
) -> wp.Function:  # fmt: skip
    """``loop(c, pairs, box, d, p, o)``: sum over the partners of cluster c, and store the sums.

    Rows must be contiguous (entry stride 1) and hold the cluster's own slots first. Outside the
    cutoff the term is evaluated at a harmless distance and multiplied away by a select, so that the
    loop has no branch.
    """
    Box, give = box_type(precision), term.function
    parts = _Parts(term, precision, periodic, partners == ROWS)
    fields = list(_fields(data, precision))
    snippet = f"""
    {parts.head()}
    {parts.room(fields)}
    {parts.own(fields)}
    for (int tile = 0; tile < count; tile += {TILE}) {{
        const int m = count - tile < {TILE} ? count - tile : {TILE}, top = (m + W - 1) / W * W;
        {parts.copies(fields)}
#pragma clang loop unroll(disable)
        for (int u0 = 0; u0 < own; u0 += {parts.rows}) {{
            {parts.passes()}
        }}
    }}
    {parts.stored(native_name(store))}
"""

    vec3, total, unit = precision.vec3, precision.vector(term.width), precision.scalar(1.0)

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


class _Parts:
    """The pieces of the snippet, in the order in which they stand there."""

    def __init__(self, term: Term, precision: Precision, periodic: Periodicity, listed: bool):
        self.term, self.precision, self.periodic, self.listed = term, precision, periodic, listed
        self.real, self.central = precision.c, term.direction is not None
        self.sums = term.width
        self.rows = 4 if self.sums <= 4 else 2  # served at once: what registers hold
        self.size = CLUSTER if listed else CROWD
        self.lanes, self.give = 16 if self.real == "float" else 8, term.function

    def head(self) -> str:
        """Whose partners, and where they are."""
        lanes = ", ".join(map(str, range(self.lanes)))
        where = (
            f"const int* row = {elements('pairs.index', 'int')} + "
            f"{elements('pairs.row', 'long long')}[c];\n    const int mine = 0, all = "
            f"{elements('pairs.count', 'int')}[c];"
            if self.listed
            else f"const int w = {elements('pairs.world', 'int')}[a];\n    const int base = "
            f"{elements('pairs.begin', 'int')}[w];\n    const int mine = a - base, all = "
            f"{elements('pairs.end', 'int')}[w] - base;"
        )
        return f"""
    constexpr int W = {self.lanes}, OFF = {CROWD};  // places of copies: own first, then partners
    static const int lane[W] = {{{lanes}}};  // as wide as numbers, which a loop's counter is not
    const int* lead = {elements("pairs.lead", "int")} + c;
    const int a = lead[0], own = lead[1] - a;
    {where}
    const int count = p.cutoff_squared > 0 ? all : 0;
    const {self.real}* x = {elements("d.x", self.real)};"""

    def room(self, fields: list[tuple[str, str, int]]) -> str:
        """Room for the copies and the sums, and the struct that points to the copies."""
        room = [f"alignas(64) {self.real} b{axis}[OFF + {TILE}];" for axis in "xyz"]
        room.append("auto local = d;")
        for k, (path, kind, width) in enumerate(fields):
            room.append(f"alignas(64) {kind} copy{k}[{width} * (OFF + {TILE}) + 1];")
            room.append(pointed(f"local.{path}", f"copy{k}", f"{width} * sizeof({kind})"))
        room.append(f"alignas(64) {self.real} sum[{self.size}][{self.sums}][W] = {{}};")
        if self.central:
            room.append(f"alignas(64) {self.real} close[W], push[{self.size}] = {{}};")
        if self.listed:
            room.append(f"alignas(64) int id[{TILE} + {AHEAD}];")
        return "\n    ".join(room)

    def own(self, fields: list[tuple[str, str, int]]) -> str:
        """Copies of the own slots, each near the first, and whether images go by that one.

        They do where all that any of them can see is within half a box of the first; and where that
        is within the box, there are none.
        """
        absolute = "__builtin_fabs" if self.real == "double" else "__builtin_fabsf"
        root = "__builtin_sqrt" if self.real == "double" else "__builtin_sqrtf"
        near = ""
        for n, (axis, on) in enumerate(zip("xyz", self.periodic, strict=True)):
            if on:
                moved = native_image(self.precision, self.periodic, "b{}[u]", "b{0}[u] - {0}0")
                line = moved.splitlines()[sum(list(self.periodic)[:n])]
                near += f"""
    {{
        const {self.real} {axis}0 = x[3*a+{n}], half = ({self.real})0.4999 * box.length[{n}];
        {self.real} most = 0;
        for (int u = 0; u < {self.size}; ++u) {{
            {line}
            const {self.real} d = {absolute}(b{axis}[u] - {axis}0);
            most = d > most ? d : most;
        }}
        near = near & (reach + most < half);
        inner = inner & ({absolute}({axis}0 - box.lower[{n}] - half) + reach + most < half);
    }}"""
        reach = f"const {self.real} reach = {root}(p.cutoff_squared);" if near else ""
        # Half a box apart, two see each other in opposite directions: by the places as they are.
        raw = f"""if (!near) for (int u = 0; u < {self.size}; ++u) {{
        const int s = a + (u < own ? u : own - 1);
        bx[u] = x[3*s], by[u] = x[3*s+1], bz[u] = x[3*s+2];
    }}""" if near else ""  # fmt: skip
        return f"""
    bool near = {"true" if self.listed or not self.periodic else "false"}, inner = near;
    {reach}
    for (int u = 0; u < {self.size}; ++u) {{
        const int s = a + (u < own ? u : own - 1);
        bx[u] = x[3*s], by[u] = x[3*s+1], bz[u] = x[3*s+2];
        {self._copied(fields, "u", "s")}
    }}
    {near}
    {raw}"""

    def copies(self, fields: list[tuple[str, str, int]]) -> str:
        """Copies of the partners of a tile, with lanes behind the last that are far away."""
        if self.listed:
            begin = f"""
        __builtin_memcpy(id, row + tile, sizeof(int) * top);
        for (int k = m; k < top; ++k) id[k] = a;
        {self._fetched()}"""
            at = "id[k]"
        else:
            begin = """
        const int from = base + tile;
        for (int k = 0; k < m; ++k)
            bx[OFF+k] = x[3*(from+k)], by[OFF+k] = x[3*(from+k)+1], bz[OFF+k] = x[3*(from+k)+2];"""
            at = "(k < m ? from + k : a)"
        image = native_image(self.precision, self.periodic, "b{}[OFF+k]", "b{0}[OFF+k] - b{0}[0]")
        moved = f"if (near & !inner) for (int k = 0; k < top; ++k) {{ {image} }}" if image else ""
        return f"""{begin}
        {moved}
        for (int k = m; k < top; ++k) bx[OFF+k] = {FAR[self.real]}, by[OFF+k] = bz[OFF+k] = 0;
#pragma clang loop vectorize(disable)
        for (int k = 0; k < top; ++k) {{ {self._copied(fields, "OFF + k", at)} }}"""

    def _copied(self, fields: list[tuple[str, str, int]], to: str, at: str) -> str:
        lines = []
        for k, (path, kind, width) in enumerate(fields):
            if path.rpartition(".")[2] == "slot":  # it holds its own places
                lines.append(f"copy{k}[{to}] = {at};")
                continue
            # A vector of three as four, of which the last is the next one's, or spare.
            many = 4 if width == 3 else width
            lines.append(
                f"__builtin_memcpy(copy{k} + {width} * ({to}), {elements(f'd.{path}', kind)} + "
                f"{width} * (long long){at}, {many} * sizeof({kind}));"
            )
        return " ".join(lines)

    def _fetched(self) -> str:
        """Positions of the slots ``id``, four at a time: rows of memory turned into planes."""
        return f"""
        typedef {self.real} V4 __attribute__((vector_size(4 * sizeof({self.real}))));
        for (int k = 0; k < top; k += 4) {{
            V4 A, B, C, D;
            __builtin_memcpy(&A, x + 3 * (long long)id[k], sizeof(V4));
            __builtin_memcpy(&B, x + 3 * (long long)id[k+1], sizeof(V4));
            __builtin_memcpy(&C, x + 3 * (long long)id[k+2], sizeof(V4));
            __builtin_memcpy(&D, x + 3 * (long long)id[k+3], sizeof(V4));
            const V4 s = __builtin_shufflevector(A, B, 0, 4, 1, 5);
            const V4 t = __builtin_shufflevector(C, D, 0, 4, 1, 5);
            const V4 u = __builtin_shufflevector(A, B, 2, 6, 3, 7);
            const V4 v = __builtin_shufflevector(C, D, 2, 6, 3, 7);
            const V4 X = __builtin_shufflevector(s, t, 0, 1, 4, 5);
            const V4 Y = __builtin_shufflevector(s, t, 2, 3, 6, 7);
            const V4 Z = __builtin_shufflevector(u, v, 0, 1, 4, 5);
            __builtin_memcpy(bx + OFF + k, &X, sizeof(V4));
            __builtin_memcpy(by + OFF + k, &Y, sizeof(V4));
            __builtin_memcpy(bz + OFF + k, &Z, sizeof(V4));
        }}"""

    def passes(self) -> str:
        """The sums of a few own slots over the tile, in registers."""
        each = range(self.rows)
        loop = f"{{ {self._pairs(image=False)} }}"
        if self.periodic:
            wide = f"{{ {self._pairs(image=True)} }}"
            loop = f"if (near) {loop} else {wide}" if self.listed else wide
        place = "\n            ".join(
            f"const {self.real} x{u} = bx[u0+{u}], y{u} = by[u0+{u}], z{u} = bz[u0+{u}];"
            for u in each
        )
        return f"""
            {place}
            {"for (int l = 0; l < W; ++l) close[l] = 0;" if self.central else ""}
            alignas(64) {self.real} now[{self.rows}][{self.sums}][W];
            __builtin_memcpy(now, sum + u0, sizeof(now));
            {loop}
            __builtin_memcpy(sum + u0, now, sizeof(now));
            {self._pushed() if self.central else ""}"""

    def _pushed(self) -> str:
        """What of central terms coincident pairs add; there are hardly ever any."""
        real = self.real
        return f"""
            {real} any = 0;
            for (int l = 0; l < W; ++l) any += close[l];
            if (any > 0) for (int u = u0; u < u0 + {self.rows}; ++u) for (int k = 0; k < m; ++k) {{
                {real} dx = bx[u] - bx[OFF+k], dy = by[u] - by[OFF+k], dz = bz[u] - bz[OFF+k];
                {native_image(self.precision, self.periodic)}
                const {real} r2 = dx*dx + dy*dy + dz*dz;
                if (r2 > p.closest_squared || r2 >= p.cutoff_squared || k + tile == mine + u)
                    continue;
                push[u] += {native_name(self.give)}(
                    u, OFF + k, {vector(3, real)}(dx, dy, dz), r2, local, p)[1];
            }}"""

    def _pairs(self, image: bool) -> str:
        selves = "\n                ".join(
            f"const int self{u} = mine + u0 + {u} - tile - k0;" for u in range(self.rows)
        )
        body = "".join(self._pair(u, image) for u in range(self.rows))
        return f"""
#pragma clang loop unroll(disable)
            for (int k0 = 0; k0 < top; k0 += W) {{
#pragma clang fp reassociate(on) contract(fast)
                {selves}
                const int behind = m - k0;
#pragma clang loop vectorize(enable) vectorize_width({self.lanes}) interleave_count(1)
                for (int l = 0; l < W; ++l) {{
                    const int k = OFF + k0 + l;
                    const {self.real} xj = bx[k], yj = by[k], zj = bz[k];
                    {body}
                }}
            }}"""

    def _pair(self, u: int, image: bool) -> str:
        real = self.real
        moved = native_image(self.precision, self.periodic) if image else ""
        inside = f"(r2 < p.cutoff_squared) & (lane[l] != self{u})"
        if image:
            inside += " & (lane[l] < behind)"
        given = range(1 if self.central else self.term.width)
        # Values first: a choice between expressions would become a branch.
        values = " ".join(
            f"const {real} t{n} = t[{n}], g{n} = inside ? t{n} : ({real})0;" for n in given
        )
        sums = ["dx * g0", "dy * g0", "dz * g0"] if self.central else [f"g{n}" for n in given]
        added = " ".join(f"now[{u}][{s}][l] += {each};" for s, each in enumerate(sums))
        if self.central:
            added += f" close[l] += inside & (r2 <= p.closest_squared) ? ({real})1 : ({real})0;"
        return f"""
                    {{
                        {real} dx = x{u} - xj, dy = y{u} - yj, dz = z{u} - zj;
                        {moved}
                        const {real} r2 = dx*dx + dy*dy + dz*dz;
                        const bool inside = {inside};
                        const {real} safe = inside ? r2 : ({real})1;
                        const {vector(self.term.returned, real)} t = {native_name(self.give)}(
                            u0 + {u}, k, {vector(3, real)}(dx, dy, dz), safe, local, p);
                        {values}
                        {added}
                    }}"""

    def stored(self, store: str) -> str:
        """The lanes' sums together, and what becomes of them."""
        real = self.real
        if self.central:
            aside = ", ".join(f"({real}){each!r}" for each in self.term.direction or ())
            total = f"""
        const {real} aside[3] = {{{aside}}};
        for (int s = 0; s < 3; ++s) total[s] = sum[u][s][0] + push[u] * aside[s];"""
        else:
            total = f"for (int s = 0; s < {self.sums}; ++s) total[s] = sum[u][s][0];"
        fours = [", ".join(map(str, range(k, k + 4))) for k in range(0, self.lanes, 4)]
        four = " + ".join(f"__builtin_shufflevector(v, v, {each})" for each in fours)
        return f"""
    typedef {real} VW __attribute__((vector_size(W * sizeof({real}))));
    for (int u = 0; u < own; ++u) {{
        for (int s = 0; s < {self.sums}; ++s) {{
            VW v;
            __builtin_memcpy(&v, sum[u][s], sizeof(v));
            const auto q = {four};
            sum[u][s][0] = (q[0] + q[2]) + (q[1] + q[3]);
        }}
        {vector(self.term.width, real)} total;
        {total}
        {store}(a + u, {elements("pairs.order", "int")}[a + u], total, d, p, o);
    }}"""
