// The bodies of the k-th node by level, halved. What stands before it (see order.py) names the
// numbers (real, LEAF bodies at most of a node that is not) and the arrays.

const int node = by_level[k], a = begin[node], b = end[node];
if (b - a <= LEAF) return;
const int mid = end[node + 1];
const long long stride = 2ll * slots;
int axis = 0;
float longest = -1;
for (int e = 0; e < 3; ++e) {
    const real low = x[3 * (long long)by[e * stride + a] + e];
    const real high = x[3 * (long long)by[e * stride + b - 1] + e];
    const float size = (float)high - (float)low;
    if (size > longest) longest = size, axis = e;
}
const int* chosen = by + axis * stride;
for (int i = a; i < mid; ++i) side[chosen[i]] = 1;
for (int i = mid; i < b; ++i) side[chosen[i]] = 0;
for (int e = 0; e < 3; ++e) {
    if (e == axis) continue;
    int *list = by + e * stride, *rest = spare + a, to = a, others = 0;
    for (int i = a; i < b; ++i) {
        const int body = list[i], first = side[body];
        list[to] = body, rest[others] = body;
        to += first, others += 1 - first;
    }
    for (int i = 0; i < others; ++i) list[to + i] = rest[i];
}
