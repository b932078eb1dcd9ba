// The bodies of world k / 3 along axis k % 3, those that are equal as they come. What stands before
// it (see order.py) names the numbers (real, FEW bodies that are sorted by insertion) and the arrays.

const int w = k / 3, axis = k % 3;
if (root[w] < 0) return;
const int a = begin[root[w]], n = end[root[w]] - a;
int *list = by + 2ll * slots * axis + a, *other = spare + (long long)slots * axis + a;
unsigned *of_list = key + 2ll * slots * axis + a, *of_other = of_list + slots;
for (int i = 0; i < n; ++i) {
    const float value = (float)x[3 * (long long)member[a + i] + axis];
    const unsigned bits = __builtin_bit_cast(unsigned, value);
    list[i] = member[a + i];
    of_list[i] = bits >> 31 ? ~bits : bits | 0x80000000u;  // in the order of the numbers
}
if (n <= FEW) {
    for (int i = 1; i < n; ++i) {
        const unsigned mine = of_list[i];
        const int body = list[i];
        int to = i;
        for (; to && of_list[to - 1] > mine; --to) {
            of_list[to] = of_list[to - 1];
            list[to] = list[to - 1];
        }
        of_list[to] = mine, list[to] = body;
    }
    return;
}
// By eight bits at a time, the lowest first: an even number of times, from list to list.
for (int shift = 0; shift < 32; shift += 8) {
    int place[257] = {};
    for (int i = 0; i < n; ++i) ++place[(of_list[i] >> shift & 255u) + 1];
    for (int d = 0; d < 256; ++d) place[d + 1] += place[d];
    for (int i = 0; i < n; ++i) {
        const int to = place[of_list[i] >> shift & 255u]++;
        of_other[to] = of_list[i], other[to] = list[i];
    }
    int* const of_bodies = list;
    unsigned* const of_keys = of_list;
    list = other, other = of_bodies;
    of_list = of_other, of_other = of_keys;
}
