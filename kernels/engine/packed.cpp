// The sums of one cluster. What stands before it (see packed.py) names the numbers (real, W lanes of
// a vector, OFF the first place of partners in the copies, TILE partners at a time, SIZE slots of a
// cluster, WIDTH numbers of a sum, AT_ONCE slots served together, CENTRAL, LISTED, PERIODIC), the
// arrays of the pairs, and: ROOM declares the copies of fields and `local`, which points to them;
// COPY(to, at) copies those of a slot; GIVE(i, j, d, r2) is the term; STORE(slot, total) ends it, in
// a loop that STORES stands before; TOUCH(particle) fetches what it will add to.

const int a = lead[c], own = lead[c + 1] - a;
const int w = world[a];
const int base = LISTED ? 0 : begin[w];
const int mine = LISTED ? 0 : a - base;  // where the own slots are among the partners
const int all = LISTED ? count[c] : end[w] - base;
const int partners = p.cutoff_squared > 0 ? all : 0;
const int* listed = index + (LISTED ? row[c] : 0);
if (LISTED)  // rows follow each other: mostly the one after the next
    for (int k = 2 * all; k < 3 * all; k += 16) __builtin_prefetch(listed + k);
for (int u = 0; u < own; ++u) { TOUCH(order[a + u]) }

typedef real V4 __attribute__((vector_size(4 * sizeof(real))));
typedef real VW __attribute__((vector_size(W * sizeof(real))));
typedef int IW __attribute__((vector_size(W * sizeof(int))));
IW places;
__builtin_memcpy(&places, lane, sizeof(places));
struct Near { enum { wide = 0 }; };
struct Wide { enum { wide = 1 }; };

alignas(64) real b[3][OFF + TILE], sum[SIZE][WIDTH][W] = {}, close[W];
alignas(64) int slots[OFF + TILE + W];
int* id = slots + OFF;  // of the partners; own ones stand before them
alignas(64) real apart[AT_ONCE][TILE];
real push[SIZE] = {};
const real never = (real)__builtin_inf();
ROOM

// A place, or displacement, moved by as many boxes as bring displacement d to the nearest image.
auto moved = [&](real place, real d, int n) __attribute__((always_inline)) -> real {
    return place - box.length[n] * __builtin_elementwise_rint(d * box.inverse[n]);
};
auto image = [&](real d, int n) __attribute__((always_inline)) -> real {
    return PERIODIC[n] ? moved(d, d, n) : d;
};

// Own slots in the image next to the first one. Images go by that one where all that any of them
// can see is within half a box of it; and where that is within the box, there are none.
const int periodic = PERIODIC[0] | PERIODIC[1] | PERIODIC[2];
bool near = LISTED | !periodic, inner = near & PLACED;
for (int u = 0; u < OFF; ++u) slots[u] = a + (u < own ? u : own - 1);
auto place_own = [&]() __attribute__((always_inline)) {
    for (int u = 0; u < SIZE; u += W) fetch(x, slots + u, 1, b[0] + u, OFF + TILE);
};
place_own();
for (int u = 0; u < SIZE; ++u) { COPY(u, slots[u]) }
if (LISTED & periodic) {
    const real reach = __builtin_elementwise_sqrt(p.cutoff_squared);
    auto wide = V4{} != V4{}, out = wide;
#pragma clang loop unroll(full)
    for (int n = 0; n < 3; ++n) {
        if (!PERIODIC[n]) continue;
        V4 o;
        __builtin_memcpy(&o, b[n], sizeof(o));
        const real first = o[0], half = (real)0.4999 * box.length[n], room = half - reach;
        o -= box.length[n] * __builtin_elementwise_rint((o - first) * box.inverse[n]);
        __builtin_memcpy(b[n], &o, sizeof(o));
        wide |= ~(__builtin_elementwise_abs(o - first) < room);
        out |= ~(__builtin_elementwise_abs(o - (box.lower[n] + half)) < room);
    }
    near = !__builtin_reduce_or(wide);
    inner = near & PLACED & !__builtin_reduce_or(out);
    // Half a box apart, two see each other in opposite directions: by the places as they are.
    if (!near) place_own();
}

// What a pair adds in a lane. The term is evaluated outside the cutoff, too, and not used there.
auto add = [&](real (*to)[W], int l, int u, int k, real dx, real dy, real dz, real r2)
                __attribute__((always_inline)) {
#pragma clang fp reassociate(on) contract(fast)
    const bool inside = r2 < p.cutoff_squared;
    const auto t = GIVE(u, k, -dx, -dy, -dz, r2);
    if (CENTRAL) {
        const real t0 = t[0], g = inside ? t0 : (real)0;
        to[0][l] -= dx * g;
        to[1][l] -= dy * g;
        to[2][l] -= dz * g;
        close[l] = r2 < close[l] ? r2 : close[l];
    } else {
#pragma clang loop unroll(full)
        for (int s = 0; s < WIDTH; ++s) {
            // A value first: a choice between expressions would be a branch.
            const real value = t[s];
            to[s][l] += inside ? value : (real)0;
        }
    }
};

for (int tile = 0; tile < partners; tile += TILE) {
    const int m = partners - tile < TILE ? partners - tile : TILE, top = (m + W - 1) / W * W;
    if (LISTED) {
        for (int k = 0; k < top; k += W) {
            IW those;
            __builtin_memcpy(&those, listed + tile + k, sizeof(those));
            those = places < m - k ? those : a;
            __builtin_memcpy(id + k, &those, sizeof(those));
        }
        for (int k = 0; k < top; k += W) fetch(x, id + k, 1, b[0] + OFF + k, OFF + TILE);
    } else {
        for (int k = 0; k < top; ++k) id[k] = k < m ? base + tile + k : a;
        for (int k = 0; k < top; ++k)
            for (int n = 0; n < 3; ++n) b[n][OFF + k] = x[3 * (long long)id[k] + n];
    }
    if (near & !inner)
        for (int n = 0; n < 3; ++n)
            if (PERIODIC[n])
                for (int k = OFF; k < OFF + top; ++k)
                    b[n][k] = moved(b[n][k], b[n][k] - b[n][0], n);
    // Behind the last: so far that the square is infinite, and 0 times it is 0.
    VW end;
    __builtin_memcpy(&end, b[0] + OFF + top - W, sizeof(end));
    end = __builtin_convertvector(places, VW) < (real)(m - top + W) ? end : FAR;
    __builtin_memcpy(b[0] + OFF + top - W, &end, sizeof(end));
#pragma clang loop vectorize(disable)
    for (int k = 0; k < top; ++k) { COPY(OFF + k, id[k]) }

    for (int l = 0; l < W; ++l) close[l] = never;
#pragma clang loop unroll(disable)
    for (int u0 = 0; u0 < SIZE; u0 += AT_ONCE) {
        if (u0 >= own) break;
        alignas(64) real now[AT_ONCE][WIDTH][W], at[AT_ONCE][3], others[AT_ONCE][W];
        __builtin_memcpy(now, sum + u0, sizeof(now));
        for (int u = 0; u < AT_ONCE; ++u)
            for (int n = 0; n < 3; ++n) at[u][n] = b[n][u0 + u];
        // The vector that they are in themselves, where each sees itself far away.
        const int self = mine + u0 - tile, with_self = self / W * W;
        if (self >= 0 && self < top)
            for (int u = 0; u < AT_ONCE; ++u)
                for (int l = 0; l < W; ++l) {
                    const bool itself = lane[l] == self - with_self + u;
                    others[u][l] = itself ? FAR : b[0][OFF + with_self + l];
                }
        // First how far apart they are, then the term: what waits for the one has the other to do.
        auto pairs_of = [&](auto kind) __attribute__((always_inline)) {
            constexpr bool wide = decltype(kind)::wide;
#pragma clang loop unroll(disable)
            for (int k0 = 0; k0 < top; k0 += W) {
#pragma clang fp reassociate(on) contract(fast)
                const bool selves = self >= 0 && k0 == with_self;
                const real* seen[AT_ONCE];
                for (int u = 0; u < AT_ONCE; ++u) seen[u] = selves ? others[u] : b[0] + OFF + k0;
#pragma clang loop vectorize(assume_safety) vectorize_width(W) interleave_count(1)
                for (int l = 0; l < W; ++l) {
                    const real yj = b[1][OFF + k0 + l], zj = b[2][OFF + k0 + l];
#pragma clang loop unroll(full)
                    for (int u = 0; u < AT_ONCE; ++u) {
                        const real xj = seen[u][l];
                        real dx = xj - at[u][0], dy = yj - at[u][1], dz = zj - at[u][2];
                        if (wide) dx = image(dx, 0), dy = image(dy, 1), dz = image(dz, 2);
                        const real r2 = dx * dx + dy * dy + dz * dz;
                        apart[u][k0 + l] = wide && xj == FAR ? never : r2;
                    }
                }
            }
#pragma clang loop unroll(disable)
            for (int k0 = 0; k0 < top; k0 += W) {
#pragma clang fp reassociate(on) contract(fast)
#pragma clang loop vectorize(assume_safety) vectorize_width(W) interleave_count(1)
                for (int l = 0; l < W; ++l) {
                    const int k = OFF + k0 + l;
                    const real xj = b[0][k], yj = b[1][k], zj = b[2][k];
#pragma clang loop unroll(full)
                    for (int u = 0; u < AT_ONCE; ++u) {
                        real dx = xj - at[u][0], dy = yj - at[u][1], dz = zj - at[u][2];
                        if (wide && xj == FAR) dx = 0;  // its image may be infinitely far
                        if (wide) dx = image(dx, 0), dy = image(dy, 1), dz = image(dz, 2);
                        add(now[u], l, u0 + u, k, dx, dy, dz, apart[u][k0 + l]);
                    }
                }
            }
        };
        if (near) pairs_of(Near()); else pairs_of(Wide());
        __builtin_memcpy(sum + u0, now, sizeof(now));
    }
    if (!CENTRAL) continue;
    // What coincident pairs add; there are hardly ever any.
    real least = never;
    for (int l = 0; l < W; ++l) least = close[l] < least ? close[l] : least;
    if (least <= CLOSEST)
        for (int u = 0; u < own; ++u)
            for (int k = 0; k < m; ++k) {
                real d[3];
                for (int n = 0; n < 3; ++n) d[n] = image(b[n][u] - b[n][OFF + k], n);
                const real r2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
                if (r2 <= CLOSEST && r2 < p.cutoff_squared && k + tile != mine + u)
                    push[u] += GIVE(u, OFF + k, d[0], d[1], d[2], r2)[1];
            }
}

// The sums over the lanes, of four slots at a time.
real total_of[WIDTH][SIZE];
#pragma clang loop unroll(full)
for (int u = 0; u < SIZE; u += 4)
#pragma clang loop unroll(full)
    for (int s = 0; s < WIDTH; ++s) {
        V4 q[4];
#pragma clang loop unroll(full)
        for (int k = 0; k < 4; ++k) {
            VW v;
            __builtin_memcpy(&v, sum[u + k][s], sizeof(v));
            q[k] = IN_FOURS(v);
        }
        const V4 A = __builtin_shufflevector(q[0], q[1], 0, 1, 4, 5)
                   + __builtin_shufflevector(q[0], q[1], 2, 3, 6, 7);
        const V4 B = __builtin_shufflevector(q[2], q[3], 0, 1, 4, 5)
                   + __builtin_shufflevector(q[2], q[3], 2, 3, 6, 7);
        const V4 all = __builtin_shufflevector(A, B, 0, 2, 4, 6)
                     + __builtin_shufflevector(A, B, 1, 3, 5, 7);
        __builtin_memcpy(&total_of[s][u], &all, sizeof(all));
    }
STORES
for (int u = 0; u < own; ++u) {
    Total total;
    for (int s = 0; s < WIDTH; ++s) total[s] = total_of[s][u] + (CENTRAL ? push[u] * ASIDE[s] : 0);
    STORE(a + u, total)
}
