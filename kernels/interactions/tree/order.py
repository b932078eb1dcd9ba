"""The order of a tree's bodies: halved at the median along the longest side of each node's box.

Three lists hold the bodies by x, by y and by z. A node has the same slots of each, so its box is
read off their ends, its lower half along an axis is the first half of that list, and the two other
lists are parted, each half staying as it is. On a CPU each node does so by itself, in C++; else a
stable sort by the nodes below does it for all nodes of a level at once, to the same order.
"""

import functools
from types import SimpleNamespace

import warp as wp

from ...native import body
from ...precision import Precision, native, register
from .nodes import LEAF, tree_type

FEW = 48  # bodies that are sorted by insertion


def _native(precision: Precision, name: str) -> wp.Function:
    """``act(k, slots, tree, ...)`` of the C++ in the file of that name."""
    arrays = {
        "x": "position", "int* by": "by_io", "unsigned* key": "keys", "int* spare": "spares",
        "int* side": "sides", "int* begin": "tree.begin", "int* end": "tree.end",
        "int* by_level": "tree.by_level", "int* root": "tree.root", "int* member": "members",
    }  # fmt: skip
    snippet = body(f"interactions/tree/{name}.cpp", precision, {"FEW": FEW, "LEAF": LEAF}, arrays)

    def act(
        k: int, slots: int, tree: tree_type(precision), members: wp.array(dtype=wp.int32),
        position: wp.array(dtype=precision.vec3), by_io: wp.array(dtype=wp.int32),
        keys: wp.array(dtype=wp.int32), spares: wp.array(dtype=wp.int32),
        sides: wp.array(dtype=wp.int32),
    ): ...  # fmt: skip

    return native(act, snippet, after_gradients=False)


@functools.cache
def native_kernel(precision: Precision, name: str) -> wp.Kernel:
    """Kernel for a CPU: ``"sort"`` a world's bodies along an axis, ``"part"`` those of a node."""
    Tree, vec3, integers = tree_type(precision), precision.vec3, wp.array(dtype=wp.int32)
    act = _native(precision, name)

    @functools.partial(register, cpu_only=True)
    def order_bodies(
        first: int,
        start: int,
        slots: int,
        tree: Tree,
        members: integers,
        position: wp.array(dtype=vec3),
        by_io: integers,
        keys: integers,
        spares: integers,
        sides: integers,
    ):
        k = start + first + wp.tid()
        act(k, slots, tree, members, position, by_io, keys, spares, sides)

    return order_bodies


@functools.cache
def sorted_kernels(precision: Precision) -> SimpleNamespace:
    """Kernels around sorts: their keys, ``coordinates`` or what ``keys`` finds of each body; of
    each the node below that it comes to, ``halves``; and ``descend`` to these.
    """
    Tree, vec3, integers = tree_type(precision), precision.vec3, wp.array(dtype=wp.int32)

    @register
    def coordinates(
        first: int, axis: int, members: integers, position: wp.array(dtype=vec3),
        key_out: wp.array(dtype=wp.float32), by_out: integers,
    ):  # fmt: skip
        i = first + wp.tid()
        key_out[i] = wp.float32(position[members[i]][axis])
        by_out[i] = members[i]

    @register
    def halves(
        first: int, slots: int, tree: Tree, at: integers, position: wp.array(dtype=vec3),
        by: integers, side_out: integers,
    ):  # fmt: skip
        """Of each body the first slot of the node below that it comes to."""
        i = first + wp.tid()
        node = at[i]
        a, b = tree.begin[node], tree.end[node]
        axis, longest = int(0), float(-1.0)
        for k in range(3):
            low = wp.float32(position[by[2 * slots * k + a]][k])
            size = wp.float32(position[by[2 * slots * k + b - 1]][k]) - low
            if size > longest:
                longest = size
                axis = k
        to = a
        if b - a > LEAF and i >= tree.end[node + 1]:
            to = tree.end[node + 1]
        side_out[by[2 * slots * axis + i]] = to

    @register
    def keys(first: int, by: integers, side: integers, key_out: integers):
        i = first + wp.tid()
        key_out[i] = side[by[i]]

    @register
    def descend(first: int, tree: Tree, at_io: integers):
        i = first + wp.tid()
        node = at_io[i]
        if tree.end[node] - tree.begin[node] > LEAF:
            at_io[i] = wp.where(i < tree.end[node + 1], node + 1, tree.next[node + 1])

    return SimpleNamespace(coordinates=coordinates, halves=halves, keys=keys, descend=descend)
