// What the bodies of group c feel of all others. What stands before it (see walk.py) names the numbers
// (real, W lanes of a vector, GROUP bodies at most, SUMS of each, AT_ONCE bodies served together, LIST
// entries that are summed at a time, CELL numbers of a cell, LEAF bodies of a node that is not halved,
// OWN: each body has a softening of its own, MEASURE: potential and virial are summed in place of the
// pull) and the arrays; STORE ends it.

typedef real V __attribute__((vector_size(W * sizeof(real))));

const int g = group[c], a = begin[g], own = end[g] - a;
const real *px = x, *py = x + stride, *pz = py + stride, *pm = pz + stride, *ps = pm + stride;
const real* box = boxes + 6ll * g;
real middle[3], half[3];
for (int n = 0; n < 3; ++n) {
    middle[n] = box[n] + (real)0.5 * (box[3 + n] - box[n]);
    const real below = middle[n] - box[n], above = box[3 + n] - middle[n];
    half[n] = below > above ? below : above;
}
// In a unit near the size of the world, a power of two: no product leaves the precision, and no place
// is rounded.
const real scale = scales[world[g]], area = scale * scale;
const real soft = p.softening_squared * area, closest = p.closest_squared * area;
const real opening = p.opening_squared;
enum { X, Y, Z, M, XX, YY, ZZ, XY, XZ, YZ, S, ENTRIES, NUMBER = XX };
alignas(64) real cell[ENTRIES][LIST], body[ENTRIES][LIST], sum[GROUP][SUMS][W] = {};
alignas(64) real mine[4][GROUP] = {};
for (int u = 0; u < own; ++u) {
    mine[X][u] = px[a + u] * scale;
    mine[Y][u] = py[a + u] * scale;
    mine[Z][u] = pz[a + u] * scale;
    mine[3][u] = OWN ? ps[a + u] * area : soft;
}
auto at = [](const real* from) __attribute__((always_inline)) -> V { return *(const V*)from; };
auto inverse_root = [](V v) __attribute__((always_inline)) -> V {
    return (real)1 / __builtin_elementwise_sqrt(v);
};

// What entries k to k + W - 1 of a list add to the sums of body u, whose place and softening are o.
auto of_bodies = [&](V* s, const real* o, int u, int k) __attribute__((always_inline)) {
    const V dx = at(body[X] + k) - o[X], dy = at(body[Y] + k) - o[Y], dz = at(body[Z] + k) - o[Z];
    const V r2 = dx * dx + dy * dy + dz * dz;
    const V s2 = OWN ? at(body[S] + k) + o[3] : V{} + o[3];
    const V h = inverse_root(r2 + s2), w = at(body[M] + k) * h;
    if (MEASURE) {
        const auto felt = (r2 + s2 > closest) & (at(body[NUMBER] + k) != (real)u);
        s[0] += felt ? w : V{};
        s[1] += felt ? w * h * h * s2 : V{};
    } else {
        const V pull = r2 > closest ? w * h * h : V{};
        s[0] += dx * pull;
        s[1] += dy * pull;
        s[2] += dz * pull;
    }
};
auto of_cells = [&](V* s, const real* o, int u, int k) __attribute__((always_inline)) {
    const V dx = at(cell[X] + k) - o[X], dy = at(cell[Y] + k) - o[Y], dz = at(cell[Z] + k) - o[Z];
    const V s2 = OWN ? at(cell[S] + k) + o[3] : V{} + o[3];
    const V h = inverse_root(dx * dx + dy * dy + dz * dz + s2), h2 = h * h;
    const V xx = at(cell[XX] + k), yy = at(cell[YY] + k), zz = at(cell[ZZ] + k);
    const V xy = at(cell[XY] + k), xz = at(cell[XZ] + k), yz = at(cell[YZ] + k);
    const V sx = xx * dx + xy * dy + xz * dz;
    const V sy = xy * dx + yy * dy + yz * dz;
    const V sz = xz * dx + yz * dy + zz * dz;
    const V along = (sx * dx + sy * dy + sz * dz) * h2, trace = xx + yy + zz;
    const V w = at(cell[M] + k) * h, v = w * h2;
    if (MEASURE) {
        s[0] += w + v * ((real)1.5 * along - (real)0.5 * trace);
        s[1] += s2 * (v + v * h2 * ((real)7.5 * along - (real)1.5 * trace));
    } else {
        const V turn = (real)3 * v * h2;
        const V pull = v + turn * ((real)2.5 * along - (real)0.5 * trace);
        s[0] += dx * pull - sx * turn;
        s[1] += dy * pull - sy * turn;
        s[2] += dz * pull - sz * turn;
    }
};
auto sum_up = [&](auto& list, int& many, auto add) __attribute__((always_inline)) {
    const int top = (many + W - 1) / W * W;
    for (int k = many; k < top; ++k) {  // without mass, and away from all
        for (int n = 0; n < ENTRIES; ++n) list[n][k] = 0;
        list[X][k] = middle[X] * scale + 4;
        if (MEASURE) list[NUMBER][k] = 0;
    }
#pragma clang loop unroll(disable)
    for (int u0 = 0; u0 < own; u0 += AT_ONCE) {
        V s[AT_ONCE][SUMS];
        real o[AT_ONCE][4];
        for (int u = 0; u < AT_ONCE; ++u) {
            for (int n = 0; n < 4; ++n) o[u][n] = mine[n][u0 + u];
            for (int n = 0; n < SUMS; ++n) s[u][n] = at(sum[u0 + u][n]);
        }
#pragma clang loop unroll(disable)
        for (int k = 0; k < top; k += W)
#pragma clang loop unroll(full)
            for (int u = 0; u < AT_ONCE; ++u) add(s[u], o[u], u0 + u, k);
        for (int u = 0; u < AT_ONCE; ++u)
            for (int n = 0; n < SUMS; ++n) *(V*)sum[u0 + u][n] = s[u][n];
    }
    many = 0;
};

int cells = 0, bodies = 0;
for (int node = root[world[g]]; node >= 0;) {
    const real* q = cell_of + CELL * (long long)node;
    real d2 = 0;
    for (int n = 0; n < 3; ++n) {
        const real d = __builtin_elementwise_abs(q[n] - middle[n]) - half[n];
        d2 += d > 0 ? d * d : 0;
    }
    if (d2 * opening > q[RADIUS] + q[SOFTENING]) {
        for (int n = X; n <= Z; ++n) cell[n][cells] = q[n] * scale;
        cell[M][cells] = q[M];
        for (int n = XX; n <= YZ; ++n) cell[n][cells] = q[n] * area;
        cell[S][cells] = q[SOFTENING] * area;
        if (++cells == LIST) sum_up(cell, cells, of_cells);
        node = next[node];
    } else if (end[node] - begin[node] <= LEAF) {
        const int b = begin[node], n = end[node] - b;
        if (bodies + n > LIST) sum_up(body, bodies, of_bodies);
        for (int k = 0; k < n; ++k) body[X][bodies + k] = px[b + k] * scale;
        for (int k = 0; k < n; ++k) body[Y][bodies + k] = py[b + k] * scale;
        for (int k = 0; k < n; ++k) body[Z][bodies + k] = pz[b + k] * scale;
        for (int k = 0; k < n; ++k) body[M][bodies + k] = pm[b + k];
        if (OWN) for (int k = 0; k < n; ++k) body[S][bodies + k] = ps[b + k] * area;
        if (MEASURE) for (int k = 0; k < n; ++k) body[NUMBER][bodies + k] = (real)(b + k - a);
        bodies += n;
        node = next[node];
    } else {
        ++node;
    }
}
if (cells) sum_up(cell, cells, of_cells);
if (bodies) sum_up(body, bodies, of_bodies);
for (int u = 0; u < own; ++u) {
    double total[SUMS] = {};
    for (int n = 0; n < SUMS; ++n)
        for (int l = 0; l < W; ++l) total[n] += sum[u][n][l];
    const long long particle = order[a + u];
    const double given = unit * pm[a + u];
    STORE
}
