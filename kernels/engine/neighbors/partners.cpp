// The rows of the clusters of super q, in world w. What stands before it (see partners.py) names the
// numbers (real, SUPER slots of a super, CLUSTER of a cluster, CLUSTERS of a super, LEAST entries
// written at once, ROUNDED that rows are rounded up to, HERE of a row, RUNS at most, MARGIN of a
// cell, PERIODIC, LANES of each mask of eight) and the arrays.

typedef unsigned char Bytes __attribute__((vector_size(8)));
typedef int Ints __attribute__((vector_size(32)));
typedef bool Bits __attribute__((ext_vector_type(SUPER)));
typedef unsigned char Hits __attribute__((ext_vector_type(SUPER)));

const real *py = px + stride, *pz = py + stride;
const int b = block_of[q], lead = leads[q];
const int size = block_end[b] - lead < SUPER ? block_end[b] - lead : SUPER;
const int c0 = cluster_of[q], clusters = (size + CLUSTER - 1) / CLUSTER;
const real at[3] = {middle[q], middle[supers_n + q], middle[2 * supers_n + q]};
const real reach[3] = {half[q], half[supers_n + q], half[2 * supers_n + q]};
// Reaches of slots and supers of their own (OWN) stand in a fourth plane: squares, and as they are.
const real *far = px + 3 * stride, *far_of = half + 3 * supers_n;
// A place or displacement, moved by as many boxes as bring displacement d to the nearest image; where
// there are none it stays as it is, to the last bit.
auto moved = [&](real place, real d, int n) __attribute__((always_inline)) -> real {
    if (!PERIODIC[n]) return place;
    return place - box.length[n] * __builtin_elementwise_rint(d * box.inverse[n]);
};
auto image = [&](real d, int n) __attribute__((always_inline)) -> real { return moved(d, d, n); };

// Own slots in the image next to the middle; a cluster that lacks slots has its first once more.
// Each sixteen times, for sixteen lanes, which the compiler would otherwise do for every super.
alignas(64) real own[3][SUPER][SUPER], own_far[SUPER];
for (int k = 0; k < SUPER; ++k) {
    const int first = k / CLUSTER * CLUSTER, s = lead + (k < size ? k : first < size ? first : 0);
    for (int n = 0; n < 3; ++n) {
        const real raw = px[n * stride + s], place = moved(raw, raw - at[n], n);
        for (int l = 0; l < SUPER; ++l) own[n][k][l] = place;
    }
    own_far[k] = OWN ? far[s] : 0;
}

// Rows are made here and, once they are whole, go to the pool of their world. One that is longer goes
// on in the pool, in twice the space each time.
alignas(64) int here[CLUSTERS][HERE + SUPER];
int* out[CLUSTERS];
int n[CLUSTERS] = {}, space[CLUSTERS], lost[LEAST + SUPER];
auto take = [&](int many) -> int* {
    const long long to = pool[w] + __atomic_fetch_add(taken + w, many, __ATOMIC_RELAXED);
    return to + many <= pool[w + 1] ? index + to : nullptr;
};
auto move = [&](int t) {
    int* to = take(2 * space[t]);
    if (!to) { out[t] = lost; return; }
    __builtin_memcpy(to, out[t], sizeof(int) * n[t]);
    out[t] = to, space[t] *= 2;
};
for (int t = 0; t < clusters; ++t) {
    out[t] = here[t], space[t] = HERE;
    for (int k = CLUSTER * t; k < size && k < CLUSTER * (t + 1); ++k) out[t][n[t]++] = lead + k;
}

// The slots of a mask of eight. All eight are written, those behind to be overwritten.
auto put = [](int* to, int s, unsigned mask) __attribute__((always_inline)) {
    Bytes chosen;
    __builtin_memcpy(&chosen, LANES + mask, sizeof(chosen));
    const Ints slots = __builtin_convertvector(chosen, Ints) + s;
    __builtin_memcpy(to, &slots, sizeof(slots));
};
// Bit l: whether entry l of sixteen is not 0.
auto bits_of = [](const unsigned char* hit) __attribute__((always_inline)) -> unsigned {
    Hits all;
    __builtin_memcpy(&all, hit, sizeof(all));
    return __builtin_bit_cast(unsigned short, __builtin_convertvector(all, Bits));
};
auto first_of = [](int many) -> unsigned { return many < SUPER ? (1u << many) - 1 : 0xffffu; };

alignas(64) unsigned char hit[CLUSTERS][SUPER], close[SUPER];
int run_a[RUNS], run_b[RUNS];
for (int other = world_first[w]; other < world_first[w + 1]; ++other) {
    const real R2 = reach_squared[b * blocks_n + other - world_first[w]];
    if (__builtin_isinf(R2)) continue;  // nothing is looked for
    const real R = (real)1.0001 * __builtin_elementwise_sqrt(R2);
    const auto& g = layout[other];
    const int s_first = super_first[other], s_end = super_first[other + 1];

    // The supers that may be within R, as runs from run_a to run_b - 1 in rising order, none twice.
    int runs = 0;
    bool all = g.dims[0] == 0;
    for (int a = 0; a < 3; ++a) all = all | !(at[a] - at[a] == 0) | !(reach[a] - reach[a] == 0);
    if (!all) {
        int from[3], to[3];
        real low[3], high[3];
        for (int e = 0; e < 3; ++e) {
            const int axis = g.axes[e];
            low[e] = (at[axis] - reach[axis] - g.lower[e]) * g.scale[e] - MARGIN;
            high[e] = (at[axis] + reach[axis] - g.lower[e]) * g.scale[e] + MARGIN;
            const real lo = __builtin_elementwise_floor(low[e] - R * g.scale[e]);
            const real hi = __builtin_elementwise_floor(high[e] + R * g.scale[e]), last = g.dims[e] - 1;
            if (g.wraps[e]) {
                const bool round = hi - lo >= last;
                from[e] = round ? 0 : (int)lo, to[e] = round ? (int)last : (int)hi;
                if (round) low[e] = -1e9, high[e] = 1e9;
            } else {
                from[e] = lo < 0 ? 0 : lo > last ? (int)last : (int)lo;
                to[e] = hi < 0 ? 0 : hi > last ? (int)last : (int)hi;
            }
        }
        auto cell = [&](int e, int k) {
            const int cells = g.dims[e];
            if (g.wraps[e]) k = ((k % cells) + cells) % cells;
            return g.backward[e] ? cells - 1 - k : k;
        };
        auto away = [&](int e, int k) -> real {
            // A cell at the edge of an open axis holds what is beyond it, too.
            if (!g.wraps[e] && (k == 0 || k == g.dims[e] - 1)) return 0;
            return (k > high[e] ? k - high[e] : k + 1 < low[e] ? low[e] - (k + 1) : 0) / g.scale[e];
        };
        auto add = [&](int column, int first, int last) {
            const int cells = g.dims[0];
            const bool turned = (g.backward[0] != 0) != ((column & 1) != 0);
            const int* start = starts + g.first + column * cells;
            const int A = start[turned ? cells - 1 - last : first];
            const int B = start[(turned ? cells - 1 - first : last) + 1];
            if (A == B) return;
            if (runs == RUNS) { all = true; return; }
            int k = runs++;
            for (; k && run_a[k - 1] > A; --k) run_a[k] = run_a[k - 1], run_b[k] = run_b[k - 1];
            run_a[k] = A, run_b[k] = B;
        };
        for (int z = from[2]; z <= to[2]; ++z) {
            const real dz = away(2, z);
            const int cz = cell(2, z);
            for (int y = from[1]; y <= to[1]; ++y) {
                const real dy = away(1, y), rest = R2 - dz * dz - dy * dy;
                if (rest < 0) continue;
                int cy = cell(1, y);
                if (cz & 1) cy = g.dims[1] - 1 - cy;
                const int column = cz * g.dims[1] + cy, cells = g.dims[0];
                const real h = __builtin_elementwise_sqrt(rest) * g.scale[0];
                const real lo = __builtin_elementwise_floor(low[0] - h);
                const real hi = __builtin_elementwise_floor(high[0] + h);
                if (!g.wraps[0]) {
                    const int first = lo < 0 ? 0 : lo > cells - 1 ? cells - 1 : (int)lo;
                    add(column, first, hi < 0 ? 0 : hi > cells - 1 ? cells - 1 : (int)hi);
                } else if (hi - lo + 1 >= cells) {
                    add(column, 0, cells - 1);
                } else {
                    const int first = (((int)lo % cells) + cells) % cells, last = first + (int)(hi - lo);
                    add(column, first, last < cells ? last : cells - 1);
                    if (last >= cells) add(column, 0, last - cells);
                }
            }
        }
        // Slots of a super are no longer in the order of their bins: whole supers.
        int done = s_first;
        for (int k = 0; k < runs; ++k) {
            const int first = s_first + (run_a[k] - block_begin[other]) / SUPER;
            run_a[k] = first < done ? done : first;
            run_b[k] = s_first + (run_b[k] - 1 - block_begin[other]) / SUPER + 1;
            done = run_b[k] > done ? run_b[k] : done;
        }
    }
    if (all) runs = 1, run_a[0] = s_first, run_b[0] = s_end;

    bool near = true;
    for (int a = 0; a < 3; ++a)
        if (PERIODIC[a]) near = near & (R + reach[a] < (real)0.4999 * box.length[a]);
    // Between boxes of these halves, whose middles are d apart.
    auto gap = [&](real d, real other, int n) __attribute__((always_inline)) -> real {
        const real free = __builtin_elementwise_abs(image(d, n)) - other - reach[n];
        return free > 0 ? free : 0;
    };
    const real *mx = middle, *my = mx + supers_n, *mz = my + supers_n;
    const real *hx = half, *hy = hx + supers_n, *hz = hy + supers_n;
    for (int k = 0; k < runs; ++k)
        for (int sixteen = run_a[k]; sixteen < run_b[k]; sixteen += SUPER) {
            // Sixteen supers at a time: those whose boxes are within R.
            for (int l = 0; l < SUPER; ++l) {
                const int sp = sixteen + l;
                const real dx = gap(mx[sp] - at[0], hx[sp], 0), dy = gap(my[sp] - at[1], hy[sp], 1);
                const real dz = gap(mz[sp] - at[2], hz[sp], 2);
                real within = R;
                if (OWN) within = (real)1.0001 * (far_of[sp] > far_of[q] ? far_of[sp] : far_of[q]);
                close[l] = dx * dx + dy * dy + dz * dz <= within * within;
            }
            unsigned those = bits_of(close) & first_of(run_b[k] - sixteen);
            for (; those; those &= those - 1) {
                const int sp = sixteen + __builtin_ctz(those);
                const int s = leads[sp];
                // Which of its sixteen slots are within R of some slot of each cluster.
                auto look = [&](auto kind) __attribute__((always_inline)) {
#pragma clang fp contract(fast)
                    constexpr bool wide = decltype(kind)::wide;
#pragma clang loop vectorize(enable)
                    for (int l = 0; l < SUPER; ++l) {
                        real xj = px[s + l], yj = py[s + l], zj = pz[s + l];
                        const real far_j = OWN ? far[s + l] : 0;
                        if (!wide) {
                            xj = moved(xj, xj - at[0], 0);
                            yj = moved(yj, yj - at[1], 1);
                            zj = moved(zj, zj - at[2], 2);
                        }
#pragma clang loop unroll(full)
                        for (int t = 0; t < CLUSTERS; ++t) {
                            real best = 0;
#pragma clang loop unroll(full)
                            for (int u = 0; u < CLUSTER; ++u) {
                                const int k = CLUSTER * t + u;
                                real dx = xj - own[0][k][l], dy = yj - own[1][k][l];
                                real dz = zj - own[2][k][l];
                                if (wide) dx = image(dx, 0), dy = image(dy, 1), dz = image(dz, 2);
                                real r2 = dx * dx + dy * dy + dz * dz;
                                if (OWN) r2 -= own_far[k] > far_j ? own_far[k] : far_j;
                                best = u == 0 || r2 < best ? r2 : best;
                            }
                            hit[t][l] = best < (OWN ? 0 : R2);
                        }
                    }
                };
                struct Near { enum { wide = 0 }; };
                struct Wide { enum { wide = 1 }; };
                if (near) look(Near()); else look(Wide());
                const unsigned there = first_of(block_end[other] - s);
                for (int t = 0; t < clusters; ++t) {
                    unsigned mask = bits_of(hit[t]) & there;
                    if (sp == q) mask &= ~(0xfu << (CLUSTER * t));
                    if (!mask) continue;
                    const int few = __builtin_popcount(mask & 0xff);
                    if (n[t] + few + LEAST > space[t] && out[t] != lost) move(t);
                    int* to = out[t] == lost ? lost : out[t] + n[t];
                    put(to, s, mask & 0xff);
                    put(to + few, s + 8, mask >> 8);
                    n[t] += few + __builtin_popcount(mask >> 8);
                }
            }
        }
}
int whole = 0;
auto rounded = [](int many) -> int { return (many + ROUNDED - 1) / ROUNDED * ROUNDED; };
for (int t = 0; t < clusters; ++t) whole += out[t] == here[t] ? rounded(n[t]) : 0;
int* to = take(whole);
for (int t = 0; t < clusters; ++t) {
    if (out[t] == here[t]) {
        out[t] = to ? to : lost;
        for (int k = 0; to && k < n[t]; k += ROUNDED)
            __builtin_memcpy(to + k, here[t] + k, sizeof(int) * ROUNDED);
        to += to ? rounded(n[t]) : 0;
    }
    const bool full = out[t] == lost;
    found[c0 + t] = n[t];
    row[c0 + t] = full ? 0 : out[t] - index;
    count[c0 + t] = full ? 0 : n[t];
    if (full) overflowed[0] = 1;
}
