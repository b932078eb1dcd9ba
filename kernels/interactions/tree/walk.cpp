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
const real soft = p.softening_squared, closest = p.closest_squared, opening = p.opening_squared;
enum { X, Y, Z, M, XX, YY, ZZ, XY, XZ, YZ, S, ENTRIES, NUMBER = XX };
alignas(64) real cell[ENTRIES][LIST], body[ENTRIES][LIST], sum[GROUP][SUMS][W] = {};
alignas(64) real mine[4][GROUP] = {};
for (int u = 0; u < own; ++u) {
    mine[X][u] = px[a + u], mine[Y][u] = py[a + u], mine[Z][u] = pz[a + u];
    mine[3][u] = OWN ? ps[a + u] : soft;
}
auto at = [](const real* from) __attribute__((always_inline)) -> V { return *(const V*)from; };
auto inverse_root = [](V v) __attribute__((always_inline)) -> V {
    return (real)1 / __builtin_elementwise_sqrt(v);
};

// What entries k to k + W - 1 of a list add to the sums of body u, whose place and softening are o.
// Products are of such that are near 1, and of masses over squares of lengths: none leaves the
// precision where its result does not.
auto of_bodies = [&](V* s, const real* o, int u, int k) __attribute__((always_inline)) {
    const V dx = at(body[X] + k) - o[X], dy = at(body[Y] + k) - o[Y], dz = at(body[Z] + k) - o[Z];
    const V r2 = dx * dx + dy * dy + dz * dz;
    const V s2 = OWN ? at(body[S] + k) + o[3] : V{} + o[3];
    if (MEASURE) {
        const auto felt = (r2 + s2 > closest) & (at(body[NUMBER] + k) != (real)u);
        const V h = felt ? inverse_root(r2 + s2) : V{}, w = at(body[M] + k) * h;
        s[0] += w;
        s[1] += w * (s2 * h * h);
    } else {
        const V h = r2 > closest ? inverse_root(r2 + s2) : V{}, pull = at(body[M] + k) * h * h;
        s[0] += dx * h * pull;
        s[1] += dy * h * pull;
        s[2] += dz * h * pull;
    }
};
auto of_cells = [&](V* s, const real* o, int u, int k) __attribute__((always_inline)) {
    const V dx = at(cell[X] + k) - o[X], dy = at(cell[Y] + k) - o[Y], dz = at(cell[Z] + k) - o[Z];
    const V s2 = OWN ? at(cell[S] + k) + o[3] : V{} + o[3];
    const V h = inverse_root(dx * dx + dy * dy + dz * dz + s2), h2 = h * h;
    const V ex = dx * h, ey = dy * h, ez = dz * h;
    const V xx = at(cell[XX] + k), yy = at(cell[YY] + k), zz = at(cell[ZZ] + k);
    const V xy = at(cell[XY] + k), xz = at(cell[XZ] + k), yz = at(cell[YZ] + k);
    const V sx = (xx * ex + xy * ey + xz * ez) * h2;
    const V sy = (xy * ex + yy * ey + yz * ez) * h2;
    const V sz = (xz * ex + yz * ey + zz * ez) * h2;
    const V along = sx * ex + sy * ey + sz * ez, trace = (xx + yy + zz) * h2;
    const V w = at(cell[M] + k) * h;
    if (MEASURE) {
        s[0] += w + w * ((real)1.5 * along - (real)0.5 * trace);
        s[1] += s2 * h2 * (w + w * ((real)7.5 * along - (real)1.5 * trace));
    } else {
        const V v = w * h, turn = (real)3 * v;
        const V pull = v + turn * ((real)2.5 * along - (real)0.5 * trace);
        s[0] += ex * pull - sx * turn;
        s[1] += ey * pull - sy * turn;
        s[2] += ez * pull - sz * turn;
    }
};
auto sum_up = [&](auto& list, int& many, auto add) __attribute__((always_inline)) {
    const int top = (many + W - 1) / W * W;
    for (int k = many; k < top; ++k) {  // without mass, and away from all
        for (int n = 0; n < ENTRIES; ++n) list[n][k] = 0;
        list[X][k] = FAR;
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
        for (int n = X; n <= YZ; ++n) cell[n][cells] = q[n];
        cell[S][cells] = q[SOFTENING];
        if (++cells == LIST) sum_up(cell, cells, of_cells);
        node = next[node];
    } else if (end[node] - begin[node] <= LEAF) {
        const int b = begin[node], n = end[node] - b;
        if (bodies + n > LIST) sum_up(body, bodies, of_bodies);
        for (int k = 0; k < n; ++k) body[X][bodies + k] = px[b + k];
        for (int k = 0; k < n; ++k) body[Y][bodies + k] = py[b + k];
        for (int k = 0; k < n; ++k) body[Z][bodies + k] = pz[b + k];
        for (int k = 0; k < n; ++k) body[M][bodies + k] = pm[b + k];
        if (OWN) for (int k = 0; k < n; ++k) body[S][bodies + k] = ps[b + k];
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
    const double given = G * pm[a + u];
    STORE
}
