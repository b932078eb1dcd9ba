"""C++: three-vectors between the rows of an array and local planes, as many at once as lanes.

A row that is loaded as a whole and transposed with others in registers costs a fraction of what
gathering its components by their indices does.
"""

from collections.abc import Iterable, Sequence

from ..precision import Precision


def lane_count(precision: Precision) -> int:
    """Numbers in 512 bits; a processor that has less takes them in pieces."""
    return 16 if precision.c == "float" else 8


def row_moves(precision: Precision, *, spare: bool = False) -> str:
    """C++ functions that move rows of three numbers, one row for each lane.

    ``fetch(x, id, stride, plane, size)``: row ``id[l * stride]`` of ``x`` comes to entry l of three
    planes, each ``size`` numbers behind the one before it. ``put`` has the same arguments and is
    the way back. What lies beside the rows is not written, and read only where there is something
    to ``spare``: a number behind the last row. Loads are then part of what takes their values.
    """
    real, lanes = precision.c, lane_count(precision)
    groups = range(0, lanes, 4)
    # Of each group of four rows ``row{k}`` holds number k, in four of its lanes.
    loads = [_joined([f"load(x, id[{g + k} * stride])" for g in groups]) for k in range(4)]
    stores = [
        f"store(x, id[{g + k} * stride], {_picked(f'row{k}', f'row{k}', range(g, g + 4))});"
        for g in groups
        for k in range(4)
    ]

    loaded = "return __builtin_masked_load(three, x + 3 * (long long)i);"
    if spare:
        loaded = "Quad v; __builtin_memcpy(&v, x + 3 * (long long)i, sizeof(v)); return v;"

    def mixed(a: str, b: str, *places: int) -> str:
        """Of every four lanes those at ``places``: 0 to 3 of a, 4 to 7 of b."""
        lane = [n if n < 4 else lanes + n - 4 for n in places]
        return _picked(a, b, [g + n for g in groups for n in lane])

    low, high, left, right = (0, 4, 1, 5), (2, 6, 3, 7), (0, 1, 4, 5), (2, 3, 6, 7)
    return f"""
    typedef {real} Quad __attribute__((ext_vector_type(4)));
    typedef {real} Lanes __attribute__((ext_vector_type({lanes})));
    typedef bool Three __attribute__((ext_vector_type(4)));
    const Three three = {{1, 1, 1, 0}};
    auto load = [=](const {real}* x, int i) -> Quad {{
        {loaded}
    }};
    auto store = [=]({real}* x, int i, Quad v) {{
        __builtin_masked_store(three, v, x + 3 * (long long)i);
    }};
    auto fetch = [=](const {real}* x, const int* id, int stride, {real}* plane, int size) {{
        {" ".join(f"const Lanes row{k} = {load};" for k, load in enumerate(loads))}
        const Lanes a = {mixed("row0", "row1", *low)}, b = {mixed("row0", "row1", *high)};
        const Lanes c = {mixed("row2", "row3", *low)}, d = {mixed("row2", "row3", *high)};
        *(Lanes*)plane = {mixed("a", "c", *left)};
        *(Lanes*)(plane + size) = {mixed("a", "c", *right)};
        *(Lanes*)(plane + 2 * size) = {mixed("b", "d", *left)};
    }};
    auto put = [=]({real}* x, const int* id, int stride, const {real}* plane, int size) {{
        const Lanes x_of = *(const Lanes*)plane, y_of = *(const Lanes*)(plane + size);
        const Lanes z_of = *(const Lanes*)(plane + 2 * size);
        const Lanes a = {mixed("x_of", "y_of", *low)}, b = {mixed("x_of", "y_of", *high)};
        const Lanes c = {mixed("z_of", "z_of", *low)}, d = {mixed("z_of", "z_of", *high)};
        const Lanes row0 = {mixed("a", "c", *left)}, row1 = {mixed("a", "c", *right)};
        const Lanes row2 = {mixed("b", "d", *left)}, row3 = {mixed("b", "d", *right)};
        {" ".join(stores)}
    }};
"""


def _picked(a: str, b: str, lanes: Iterable[int]) -> str:
    return f"__builtin_shufflevector({a}, {b}, {', '.join(map(str, lanes))})"


def _joined(parts: Sequence[str]) -> str:
    """Vectors of four, one behind the other."""
    if len(parts) == 1:
        return parts[0]
    half = len(parts) // 2
    return _picked(_joined(parts[:half]), _joined(parts[half:]), range(4 * len(parts)))
