// Slots from `first` on, n of them, in an order by halves of their longest side. What stands before
// it (see clusters.py) names the numbers (real, MOST slots, SUPER, CLUSTER, PERIODIC), the planes x of
// positions, `stride` apart, and the particles `order` of the slots.

real* planes[3] = {x + first, x + stride + first, x + 2 * stride + first};
int* slots = order + first;
real v[3][MOST], kept[MOST];
int from[MOST], rank[MOST], moved[MOST];
for (int a = 0; a < 3; ++a)
    for (int k = 0; k < n; ++k) {
        real d = planes[a][k] - planes[a][0];
        if (PERIODIC[a]) d -= box.length[a] * __builtin_elementwise_rint(d * box.inverse[a]);
        v[a][k] = d == d ? d : 0;  // what is no number has no order
    }
for (int k = 0; k < n; ++k) from[k] = k;
int todo[64], size[64], left = 1;
todo[0] = 0, size[0] = n;
while (left--) {
    const int lo = todo[left], m = size[left];
    if (m <= CLUSTER) continue;
    int axis = 0;
    real longest = -1;
    for (int a = 0; a < 3; ++a) {
        real low = v[a][lo], high = low;
        for (int k = lo; k < lo + m; ++k) {
            low = v[a][k] < low ? v[a][k] : low;
            high = v[a][k] > high ? v[a][k] : high;
        }
        if (high - low > longest) longest = high - low, axis = a;
    }
    const real* value = v[axis] + lo;
    for (int k = 0; k < m; ++k) {
        int before = 0;
        const real mine = value[k];
        for (int j = 0; j < k; ++j) before += value[j] <= mine;
        for (int j = k + 1; j < m; ++j) before += value[j] < mine;
        rank[k] = before;
    }
    for (int a = 0; a < 3; ++a) {
        for (int k = 0; k < m; ++k) kept[rank[k]] = v[a][lo + k];
        for (int k = 0; k < m; ++k) v[a][lo + k] = kept[k];
    }
    for (int k = 0; k < m; ++k) moved[rank[k]] = from[lo + k];
    for (int k = 0; k < m; ++k) from[lo + k] = moved[k];
    const int part = m > SUPER ? (m / 2 + SUPER - 1) / SUPER * SUPER : m > SUPER / 2 ? SUPER / 2 : CLUSTER;
    todo[left] = lo, size[left++] = part;
    todo[left] = lo + part, size[left++] = m - part;
}
for (int a = 0; a < 3; ++a) {
    for (int k = 0; k < n; ++k) kept[k] = planes[a][k];
    for (int k = 0; k < n; ++k) planes[a][k] = kept[from[k]];
}
for (int k = 0; k < n; ++k) moved[k] = slots[k];
for (int k = 0; k < n; ++k) slots[k] = moved[from[k]];
