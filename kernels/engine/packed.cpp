// The sums of one cluster. What stands before it (see packed.py) names the numbers (real, W lanes of
// a vector, OFF the first place of partners in the copies, TILE partners at a time, SIZE slots of a
// cluster, WIDTH numbers of a sum, AT_ONCE slots served together, CENTRAL, LISTED, PERIODIC), the
// arrays of the pairs, and: ROOM declares the copies of fields and `local`, which points to them;
// COPY(to, at) copies those of a slot; GIVE(i, j, d, r2) is the term; STORE(slot, total) ends it.

const int a = lead[c], own = lead[c + 1] - a;
const int w = world[a];
const int base = LISTED ? 0 : begin[w];
const int mine = LISTED ? 0 : a - base;  // where the own slots are among the partners
const int all = LISTED ? count[c] : end[w] - base;
const int partners = p.cutoff_squared > 0 ? all : 0;
const int* listed = index + (LISTED ? row[c] : 0);

typedef real V4 __attribute__((vector_size(4 * sizeof(real))));
typedef real VW __attribute__((vector_size(W * sizeof(real))));
struct Near { enum { wide = 0 }; };
struct Wide { enum { wide = 1 }; };

alignas(64) real b[3][OFF + TILE], sum[SIZE][WIDTH][W] = {}, close[W];
alignas(64) int id[TILE + W];
real push[SIZE] = {};
ROOM

// A place, or displacement, moved by as many boxes as bring displacement d to the nearest image.
auto moved = [&](real place, real d, int n) __attribute__((always_inline)) -> real {
    return place - box.length[n] * __builtin_elementwise_rint(d * box.inverse[n]);
};
auto image = [&](real d, int n) __attribute__((always_inline)) -> real { return moved(d, d, n); };

// Own slots in the image next to the first one. Images go by that one where all that any of them
// can see is within half a box of it; and where that is within the box, there are none.
const int periodic = PERIODIC[0] | PERIODIC[1] | PERIODIC[2];
bool near = LISTED | !periodic, inner = near & PLACED;
for (int u = 0; u < SIZE; ++u) {
    const int s = a + (u < own ? u : own - 1);
    for (int n = 0; n < 3; ++n) b[n][u] = x[3 * s + n];
    COPY(u, s)
}
for (int n = 0; n < 3; ++n) {
    if (!PERIODIC[n]) continue;
    const real first = b[n][0], half = (real)0.4999 * box.length[n];
    const real reach = __builtin_elementwise_sqrt(p.cutoff_squared);
    real most = 0;
    for (int u = 0; u < SIZE; ++u) {
        b[n][u] = moved(b[n][u], b[n][u] - first, n);
        most = __builtin_elementwise_max(most, __builtin_elementwise_abs(b[n][u] - first));
    }
    near = near & (reach + most < half);
    inner = inner & (__builtin_elementwise_abs(first - box.lower[n] - half) + reach + most < half);
}
// Half a box apart, two see each other in opposite directions: by the places as they are.
if (!near)
    for (int u = 0; u < SIZE; ++u)
        for (int n = 0; n < 3; ++n) b[n][u] = x[3 * (a + (u < own ? u : own - 1)) + n];

for (int tile = 0; tile < partners; tile += TILE) {
    const int m = partners - tile < TILE ? partners - tile : TILE, top = (m + W - 1) / W * W;
    if (LISTED) {
        __builtin_memcpy(id, listed + tile, sizeof(int) * top);
        for (int k = m; k < top; ++k) id[k] = a;
        // Rows of memory turned into planes, four at a time.
        for (int k = 0; k < top; k += 4) {
            V4 A, B, C, D;
            __builtin_memcpy(&A, x + 3 * (long long)id[k], sizeof(V4));
            __builtin_memcpy(&B, x + 3 * (long long)id[k + 1], sizeof(V4));
            __builtin_memcpy(&C, x + 3 * (long long)id[k + 2], sizeof(V4));
            __builtin_memcpy(&D, x + 3 * (long long)id[k + 3], sizeof(V4));
            const V4 s = __builtin_shufflevector(A, B, 0, 4, 1, 5);
            const V4 t = __builtin_shufflevector(C, D, 0, 4, 1, 5);
            const V4 u = __builtin_shufflevector(A, B, 2, 6, 3, 7);
            const V4 v = __builtin_shufflevector(C, D, 2, 6, 3, 7);
            const V4 X = __builtin_shufflevector(s, t, 0, 1, 4, 5);
            const V4 Y = __builtin_shufflevector(s, t, 2, 3, 6, 7);
            const V4 Z = __builtin_shufflevector(u, v, 0, 1, 4, 5);
            __builtin_memcpy(b[0] + OFF + k, &X, sizeof(V4));
            __builtin_memcpy(b[1] + OFF + k, &Y, sizeof(V4));
            __builtin_memcpy(b[2] + OFF + k, &Z, sizeof(V4));
        }
    } else {
        for (int k = 0; k < top; ++k) id[k] = k < m ? base + tile + k : a;
        for (int k = 0; k < m; ++k)
            for (int n = 0; n < 3; ++n) b[n][OFF + k] = x[3 * (long long)(base + tile + k) + n];
    }
    if (near & !inner)
        for (int n = 0; n < 3; ++n)
            if (PERIODIC[n])
                for (int k = OFF; k < OFF + top; ++k)
                    b[n][k] = moved(b[n][k], b[n][k] - b[n][0], n);
    // Behind the last: so far that the square is infinite, and 0 times it is 0. Images of that would
    // be no numbers; where there are any, lanes are counted.
    for (int k = OFF + m; k < OFF + top; ++k)
        for (int n = 0; n < 3; ++n) b[n][k] = (near && n == 0) ? FAR : b[n][0];
#pragma clang loop vectorize(disable)
    for (int k = 0; k < top; ++k) { COPY(OFF + k, id[k]) }

#pragma clang loop unroll(disable)
    for (int u0 = 0; u0 < SIZE; u0 += AT_ONCE) {
        if (u0 >= own) break;
        alignas(64) real now[AT_ONCE][WIDTH][W], at[AT_ONCE][3];
        __builtin_memcpy(now, sum + u0, sizeof(now));
        for (int u = 0; u < AT_ONCE; ++u)
            for (int n = 0; n < 3; ++n) at[u][n] = b[n][u0 + u];
        for (int l = 0; l < W; ++l) close[l] = 0;
        auto pairs_of = [&](auto kind) __attribute__((always_inline)) {
            constexpr bool wide = decltype(kind)::wide;
#pragma clang loop unroll(disable)
            for (int k0 = 0; k0 < top; k0 += W) {
#pragma clang fp reassociate(on) contract(fast)
                const int self = mine + u0 - tile - k0, behind = m - k0;
#pragma clang loop vectorize(enable) vectorize_width(W) interleave_count(1)
                for (int l = 0; l < W; ++l) {
                    const int k = OFF + k0 + l;
                    const real xj = b[0][k], yj = b[1][k], zj = b[2][k];
#pragma clang loop unroll(full)
                    for (int u = 0; u < AT_ONCE; ++u) {
                        real dx = at[u][0] - xj, dy = at[u][1] - yj, dz = at[u][2] - zj;
                        if (wide) {
                            if (PERIODIC[0]) dx = image(dx, 0);
                            if (PERIODIC[1]) dy = image(dy, 1);
                            if (PERIODIC[2]) dz = image(dz, 2);
                        }
                        const real r2 = dx * dx + dy * dy + dz * dz;
                        bool inside = (r2 < p.cutoff_squared) & (lane[l] != self + u);
                        if (wide) inside = inside & (lane[l] < behind);
                        const real safe = inside ? r2 : (real)1;
                        const auto t = GIVE(u0 + u, k, dx, dy, dz, safe);
                        if (CENTRAL) {
                            const real t0 = t[0], g = inside ? t0 : (real)0;
                            now[u][0][l] += dx * g;
                            now[u][1][l] += dy * g;
                            now[u][2][l] += dz * g;
                            close[l] += (inside & (r2 <= CLOSEST)) ? (real)1 : (real)0;
                        } else {
#pragma clang loop unroll(full)
                            for (int s = 0; s < WIDTH; ++s) {
                                // A value first: a choice between expressions would be a branch.
                                const real value = t[s];
                                now[u][s][l] += inside ? value : (real)0;
                            }
                        }
                    }
                }
            }
        };
        if (near) pairs_of(Near()); else pairs_of(Wide());
        __builtin_memcpy(sum + u0, now, sizeof(now));
        if (!CENTRAL) continue;
        // What coincident pairs add; there are hardly ever any.
        real any = 0;
        for (int l = 0; l < W; ++l) any += close[l];
        if (any > 0)
            for (int u = u0; u < u0 + AT_ONCE; ++u)
                for (int k = 0; k < m; ++k) {
                    real d[3];
                    for (int n = 0; n < 3; ++n) {
                        d[n] = b[n][u] - b[n][OFF + k];
                        if (PERIODIC[n]) d[n] = image(d[n], n);
                    }
                    const real r2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
                    if (r2 <= CLOSEST && r2 < p.cutoff_squared && k + tile != mine + u)
                        push[u] += GIVE(u, OFF + k, d[0], d[1], d[2], r2)[1];
                }
    }
}

for (int u = 0; u < own; ++u) {
    for (int s = 0; s < WIDTH; ++s) {
        VW v;
        __builtin_memcpy(&v, sum[u][s], sizeof(v));
        const V4 q = IN_FOURS(v);
        sum[u][s][0] = (q[0] + q[2]) + (q[1] + q[3]);
    }
    Total total;
    for (int s = 0; s < WIDTH; ++s) total[s] = sum[u][s][0] + (CENTRAL ? push[u] * ASIDE[s] : 0);
    STORE(a + u, total)
}
