"""Partners of clusters on a CPU: the rows of a list, sixteen candidates at a time."""

import functools

import warp as wp

from ..precision import Precision, native, register
from ..warp_internals import columns, elements
from .clusters import SUPER, supers_type
from .columns import columns_type
from .loops import Pairs, Periodicity, box_type, native_image
from .neighbors import blocks_type
from .packed import CLUSTER

CLUSTERS = SUPER // CLUSTER  # of a super
RUNS = 256  # of slots that one super looks at; if there are more it looks at all
LEAST = 8  # entries that a row has room for, and that are written at once
MARGIN = 0.02  # of a cell, for the rounding of cells

# For each mask of eight hits, the lanes of its set bits, one byte each, lowest first.
_LANES = ",".join(
    f"{sum(lane << (8 * k) for k, lane in enumerate(b for b in range(8) if mask >> b & 1)):#x}ull"
    for mask in range(256)
)


@wp.struct
class Attic:
    """Where rows go on that are full: entries of the index behind all rows, by world."""

    first: wp.array(dtype=wp.int64)  # world -> first entry, and at the end one more
    taken: wp.array(dtype=wp.int32)  # world -> entries in use


def _runs(precision: Precision) -> str:
    """C++: the supers of block ``other`` that may be within R of the box around super q.

    As runs from ``run_a`` to ``run_b`` - 1, in rising order, none twice.
    """
    real = precision.c
    floor = "__builtin_floor" if real == "double" else "__builtin_floorf"
    root = "__builtin_sqrt" if real == "double" else "__builtin_sqrtf"
    return f"""
    const auto& g = layout[other];
    const int s_first = super_first[other], s_end = super_first[other + 1];
    int runs = 0;
    bool all = g.dims[0] == 0;
    if (__builtin_isinf(R2)) continue;  // nothing is looked for
    if (!all) {{
        int from[3], to[3];
        {real} low[3], high[3], gap[3];
        for (int e = 0; e < 3; ++e) {{
            const int axis = g.axes[e];
            low[e] = (middle[axis * supers_n + q] - half[axis * supers_n + q] - g.lower[e]) * g.scale[e];
            high[e] = (middle[axis * supers_n + q] + half[axis * supers_n + q] - g.lower[e]) * g.scale[e];
            low[e] -= ({real}){MARGIN}, high[e] += ({real}){MARGIN};
            gap[e] = 1 / g.scale[e];
            const {real} lo = {floor}(low[e] - R * g.scale[e]), hi = {floor}(high[e] + R * g.scale[e]);
            const {real} n = g.dims[e];
            if (g.wraps[e]) {{
                const bool round = hi - lo + 1 >= n;
                from[e] = round ? 0 : (int)lo, to[e] = round ? g.dims[e] - 1 : (int)hi;
                if (round) low[e] = -1e9, high[e] = 1e9;
            }} else {{
                from[e] = lo < 0 ? 0 : lo > n - 1 ? g.dims[e] - 1 : (int)lo;
                to[e] = hi < 0 ? 0 : hi > n - 1 ? g.dims[e] - 1 : (int)hi;
            }}
        }}
        const int* start = starts + g.first;
        auto cell = [&](int e, int k) {{
            const int n = g.dims[e];
            if (g.wraps[e]) k = ((k % n) + n) % n;
            return g.backward[e] ? n - 1 - k : k;
        }};
        auto away = [&](int e, int k) {{
            // A cell at the edge of an open axis holds what is beyond it, too.
            const bool edge = !g.wraps[e] & ((k == 0) | (k == g.dims[e] - 1));
            const {real} d = k > high[e] ? k - high[e] : k + 1 < low[e] ? low[e] - (k + 1) : 0;
            return edge ? ({real})0 : d * gap[e];
        }};
        for (int z = from[2]; z <= to[2] && !all; ++z) {{
            const {real} dz = away(2, z);
            const int cz = cell(2, z);
            for (int y = from[1]; y <= to[1]; ++y) {{
                const {real} dy = away(1, y), rest = R2 - dz * dz - dy * dy;
                if (rest < 0) continue;
                int cy = cell(1, y);
                if (cz & 1) cy = g.dims[1] - 1 - cy;
                const int column = cz * g.dims[1] + cy, n = g.dims[0];
                const {real} h = {root}(rest) * g.scale[0];
                const {real} lo = {floor}(low[0] - h), hi = {floor}(high[0] + h);
                int pieces[2][2], count = 1;
                if (!g.wraps[0] || hi - lo + 1 >= n) {{
                    const bool round = g.wraps[0];
                    pieces[0][0] = round || lo < 0 ? 0 : lo > n - 1 ? n - 1 : (int)lo;
                    pieces[0][1] = round || hi > n - 1 ? n - 1 : hi < 0 ? 0 : (int)hi;
                }} else {{
                    const int a = (((int)lo % n) + n) % n, b = a + (int)(hi - lo);
                    pieces[0][0] = a, pieces[0][1] = b < n ? b : n - 1;
                    if (b >= n) pieces[1][0] = 0, pieces[1][1] = b - n, count = 2;
                }}
                for (int t = 0; t < count; ++t) {{
                    int a = pieces[t][0], b = pieces[t][1];
                    if ((g.backward[0] != 0) != ((column & 1) != 0)) {{
                        const int kept = a;
                        a = n - 1 - b, b = n - 1 - kept;
                    }}
                    const int A = start[column * n + a], B = start[column * n + b + 1];
                    if (A == B) continue;
                    if (runs == {RUNS}) {{ all = true; break; }}
                    int k = runs++;
                    for (; k && run_a[k - 1] > A; --k)
                        run_a[k] = run_a[k - 1], run_b[k] = run_b[k - 1];
                    run_a[k] = A, run_b[k] = B;
                }}
                if (all) break;
            }}
        }}
        // Slots of a super are no longer in the order of their bins: whole supers.
        const int b0 = block_begin[other];
        int done = s_first;
        for (int k = 0; k < runs; ++k) {{
            const int a = s_first + (run_a[k] - b0) / {SUPER};
            const int b = s_first + (run_b[k] - 1 - b0) / {SUPER} + 1;
            run_a[k] = a < done ? done : a;
            run_b[k] = b;
            done = b > done ? b : done;
        }}
    }}
    if (all) runs = 1, run_a[0] = s_first, run_b[0] = s_end;
"""


def _hits(precision: Precision, periodic: Periodicity, image: bool) -> str:
    """C++: which of the sixteen slots from s on are within R of some slot of each cluster."""
    real = precision.c
    near = native_image(precision, periodic, "{}j", "{0}j - {0}m")
    each = native_image(precision, periodic)
    return f"""{{
#pragma clang fp contract(fast)
#pragma clang loop vectorize(enable)
    for (int l = 0; l < {SUPER}; ++l) {{
        {real} xj = px[s + l], yj = py[s + l], zj = pz[s + l];
        {"" if image else near}
#pragma clang loop unroll(full)
        for (int t = 0; t < {CLUSTERS}; ++t) {{
            {real} best = 0;
#pragma clang loop unroll(full)
            for (int u = 0; u < {CLUSTER}; ++u) {{
                {real} dx = xj - own[0][{CLUSTER} * t + u], dy = yj - own[1][{CLUSTER} * t + u],
                       dz = zj - own[2][{CLUSTER} * t + u];
                {each if image else ""}
                const {real} r2 = dx*dx + dy*dy + dz*dz;
                best = u == 0 || r2 < best ? r2 : best;
            }}
            hit[t][l] = best < R2;
        }}
    }}
    }}"""


def _look(precision: Precision, periodic: Periodicity) -> wp.Function:
    """``look(q, w, ...)``: make the rows of the clusters of super q."""
    real, Box = precision.c, box_type(precision)
    absolute = "__builtin_fabs" if real == "double" else "__builtin_fabsf"
    apart = native_image(precision, periodic)
    nearly = " & ".join(
        f"(R + half[{n} * supers_n + q] < ({real})0.4999 * box.length[{n}])"
        for n, on in enumerate(periodic)
        if on
    )
    test = (
        f"""
            bool near = {nearly or "true"};
            if (near) {{ {_hits(precision, periodic, False)} }}
            else {{ {_hits(precision, periodic, True)} }}"""
        if periodic
        else _hits(precision, periodic, False)
    )
    snippet = f"""
    typedef unsigned char Bytes __attribute__((vector_size(8)));
    typedef int Ints __attribute__((vector_size(32)));
    static const unsigned long long lanes[256] = {{{_LANES}}};
    const long long stride = {columns("x")}, supers_n = {columns("supers.middle")};
    const {real} *px = {elements("x", real)}, *py = px + stride, *pz = py + stride;
    const {real} *middle = {elements("supers.middle", real)}, *half = {elements("supers.half", real)};
    const int* super_first = {elements("supers.first", "int")};
    const int* super_lead = {elements("supers.lead", "int")};
    const int* block_begin = {elements("blocks.begin", "int")};
    const int* block_end = {elements("blocks.end", "int")};
    const auto* layout = columns.data;
    const int* starts = {elements("starts_in", "int")};
    const int b = {elements("supers.block", "int")}[q], lead = super_lead[q];
    const int size = block_end[b] - lead < {SUPER} ? block_end[b] - lead : {SUPER};
    const int c0 = {elements("supers.cluster", "int")}[q];
    const int clusters = (size + {CLUSTER - 1}) / {CLUSTER};
    const int room = {elements("blocks.room", "int")}[b];
    int* index = {elements("pairs.index", "int")};
    long long* row = {elements("pairs.row", "long long")} + c0;
    int* taken = {elements("attic.taken", "int")} + w;
    const long long attic_end = {elements("attic.first", "long long")}[w + 1];
    int lost[{LEAST}];
    const {real} xm = middle[q], ym = middle[supers_n + q], zm = middle[2 * supers_n + q];
    {real} own[3][{SUPER}];
    int* out[{CLUSTERS}];
    int n[{CLUSTERS}] = {{}}, space[{CLUSTERS}];
    // A row that is full goes on in the attic of its world, in twice the space.
    auto move = [&](int t) {{
        const int more = 2 * space[t];
        const long long to = {elements("attic.first", "long long")}[w]
            + __atomic_fetch_add(taken, more, __ATOMIC_RELAXED);
        if (out[t] == lost || to + more > attic_end) {{ out[t] = lost; return; }}
        __builtin_memcpy(index + to, out[t], sizeof(int) * n[t]);
        out[t] = index + to, space[t] = more, row[t] = to;
    }};
    for (int k = 0; k < {SUPER}; ++k) {{
        // A cluster that lacks slots has its first once more.
        const int s = lead + (k < size ? k : k / {CLUSTER} * {CLUSTER} < size ? k / {CLUSTER} * {CLUSTER} : 0);
        own[0][k] = px[s], own[1][k] = py[s], own[2][k] = pz[s];
        {_own_image(precision, periodic)}
    }}
    for (int t = 0; t < clusters; ++t) {{
        row[t] = {elements("blocks.row", "long long")}[b]
            + (long long)room * (c0 + t - {elements("blocks.cluster", "int")}[b]);
        out[t] = index + row[t], space[t] = room;
        for (int k = {CLUSTER} * t; k < size && k < {CLUSTER} * (t + 1); ++k)
            out[t][n[t]++] = lead + k;
    }}
    int run_a[{RUNS}], run_b[{RUNS}];
    unsigned char hit[{CLUSTERS}][{SUPER}];
    const int first_block = {elements("blocks.first", "int")}[w];
    const int last_block = {elements("blocks.first", "int")}[w + 1];
    for (int other = first_block; other < last_block; ++other) {{
        const {real} R2 = {elements("blocks.reach_squared", real)}[
            b * {columns("blocks.reach_squared")} + other - first_block];
        const {real} R = ({real})1.0001 * {"__builtin_sqrt" if real == "double" else "__builtin_sqrtf"}(R2);
        {_runs(precision)}
        for (int k = 0; k < runs; ++k) for (int sp = run_a[k]; sp < run_b[k]; ++sp) {{
            {{
                {real} dx = middle[sp] - xm, dy = middle[supers_n + sp] - ym,
                       dz = middle[2 * supers_n + sp] - zm;
                {apart}
                dx = {absolute}(dx) - half[sp] - half[q];
                dy = {absolute}(dy) - half[supers_n + sp] - half[supers_n + q];
                dz = {absolute}(dz) - half[2 * supers_n + sp] - half[2 * supers_n + q];
                dx = dx > 0 ? dx : 0, dy = dy > 0 ? dy : 0, dz = dz > 0 ? dz : 0;
                if (dx*dx + dy*dy + dz*dz > R * R) continue;
            }}
            const int s = super_lead[sp];
            const int there = block_end[other] - s < {SUPER} ? block_end[other] - s : {SUPER};
            {test}
            for (int t = 0; t < clusters; ++t) for (int h = 0; h < {SUPER}; h += 8) {{
                unsigned long long word;
                __builtin_memcpy(&word, hit[t] + h, 8);
                unsigned mask = (word * 0x0102040810204080ull) >> 56;
                if (there - h < 8) mask &= there > h ? (1u << (there - h)) - 1 : 0;
                if (sp == q && {CLUSTER} * t / 8 * 8 == h) mask &= ~(0xfu << ({CLUSTER} * t % 8));
                if (!mask) continue;
                const unsigned long long picks = lanes[mask];
                if (n[t] + {LEAST} > space[t] && out[t] != lost) move(t);
                int* to = out[t] == lost ? lost : out[t] + n[t];
                Bytes chosen;
                __builtin_memcpy(&chosen, &picks, sizeof(chosen));
                const Ints at = __builtin_convertvector(chosen, Ints) + (s + h);
                __builtin_memcpy(to, &at, sizeof(at));
                n[t] += __builtin_popcount(mask);
            }}
        }}
    }}
    for (int t = 0; t < clusters; ++t) {{
        {elements("found_out", "int")}[c0 + t] = n[t];
        {elements("pairs.count", "int")}[c0 + t] = out[t] == lost ? 0 : n[t];
        if (out[t] == lost) {elements("overflow", "int")}[0] = 1;
    }}
"""
    Columns, Supers, Blocks = (
        columns_type(precision), supers_type(precision), blocks_type(precision)
    )  # fmt: skip

    def look(
        q: int, w: int, box: Box, blocks: Blocks, columns: wp.array(dtype=Columns),
        starts_in: wp.array(dtype=wp.int32), supers: Supers, attic: Attic,
        x: wp.array2d(dtype=precision.scalar), pairs: Pairs, found_out: wp.array(dtype=wp.int32), overflow: wp.array(dtype=wp.int32),
    ): ...  # fmt: skip

    return native(look, snippet, after_gradients=False)


def _own_image(precision: Precision, periodic: Periodicity) -> str:
    """C++: bring own slot k into the image that is nearest to the middle of its super."""
    rint = "__builtin_rintf" if precision.c == "float" else "__builtin_rint"
    return "\n        ".join(
        f"own[{n}][k] -= box.length[{n}] * {rint}((own[{n}][k] - {axis}m) * box.inverse[{n}]);"
        for n, (axis, on) in enumerate(zip("xyz", periodic, strict=True))
        if on
    )


@functools.cache
def partners_kernel(precision: Precision, periodic: Periodicity) -> wp.Kernel:
    """Kernel: for every super of a world that has moved, the rows of its clusters."""
    real, Box, Blocks = precision.scalar, box_type(precision), blocks_type(precision)
    Columns, Supers = columns_type(precision), supers_type(precision)
    look = _look(precision, periodic)

    @functools.partial(register, cpu_only=True)
    def find_partners(
        first: int,
        moved: wp.array(dtype=wp.int32),
        box: wp.array(dtype=Box),
        blocks: Blocks,
        columns_in: wp.array(dtype=Columns),
        starts_in: wp.array(dtype=wp.int32),
        supers: Supers,
        attic: Attic,
        x: wp.array2d(dtype=real),
        pairs: Pairs,
        found_out: wp.array(dtype=wp.int32),
        overflow: wp.array(dtype=wp.int32),
    ):
        q = first + wp.tid()
        w = pairs.world[supers.lead[q]]
        if moved[w] != 0:
            look(
                q, w, box[w], blocks, columns_in, starts_in, supers, attic, x, pairs, found_out,
                overflow,
            )  # fmt: skip

    return find_partners
