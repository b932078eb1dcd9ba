"""The moments of a tree's nodes, from the leaves up."""

import functools
from types import SimpleNamespace

import warp as wp

from ...precision import Precision, function, register
from .nodes import CELL, LEAF, MASS, RADIUS, SECOND, SOFTENING, tree_type


def _of_leaf(precision: Precision) -> wp.Function:
    """``leaf(node, tree)``: sum up a node's bodies."""
    real, vec3, Tree = precision.scalar, precision.vec3, tree_type(precision)
    Cell, Corners = precision.vector(CELL), precision.vector(6)
    add_square = _adding_square(precision)

    def leaf(node: int, tree: Tree):
        a, b = tree.begin[node], tree.end[node]
        q, box = Cell(), Corners()
        o = vec3(tree.x[0, a], tree.x[1, a], tree.x[2, a])
        c, low, high = o + vec3(), o + vec3(), o + vec3()  # copies: a name alone would be o itself
        for i in range(a, b):
            x = vec3(tree.x[0, i], tree.x[1, i], tree.x[2, i])
            q[MASS] += tree.x[3, i]
            low = wp.min(low, x)
            high = wp.max(high, x)
        m = wp.where(q[MASS] > real(0.0), q[MASS], real(1.0))
        for i in range(a, b):
            part = tree.x[3, i] / m
            c += part * (vec3(tree.x[0, i], tree.x[1, i], tree.x[2, i]) - o)
            q[SOFTENING] += part * tree.x[4, i]
        for i in range(a, b):
            y = vec3(tree.x[0, i], tree.x[1, i], tree.x[2, i]) - c
            q = add_square(q, tree.x[3, i] / m, y)
            q[RADIUS] = wp.max(q[RADIUS], wp.dot(y, y))
        for k in range(3):
            q[k] = c[k]
            box[k] = low[k]
            box[3 + k] = high[k]
        tree.cell[node] = q
        tree.box[node] = box

    return function(leaf)


def _of_two(precision: Precision) -> wp.Function:
    """``two(node, tree)``: sum up the two nodes below one."""
    real, vec3, Tree = precision.scalar, precision.vec3, tree_type(precision)
    Cell, Corners = precision.vector(CELL), precision.vector(6)
    add_square = _adding_square(precision)

    def two(node: int, tree: Tree):
        upper = tree.next[node + 1]
        l, r = tree.cell[node + 1], tree.cell[upper]
        of_l, of_r = tree.box[node + 1], tree.box[upper]
        q, box = Cell(), Corners()
        m = l[MASS] + r[MASS]
        right = wp.where(m > real(0.0), r[MASS] / m, real(0.5))
        left = real(1.0) - right
        d = vec3(r[0] - l[0], r[1] - l[1], r[2] - l[2])
        c = vec3(l[0], l[1], l[2]) + right * d
        for k in range(SECOND, CELL):
            q[k] = left * l[k] + right * r[k]
        q = add_square(q, right * left, d)
        q[MASS] = m
        corner = vec3()
        for k in range(3):
            q[k] = c[k]
            box[k] = wp.min(of_l[k], of_r[k])
            box[3 + k] = wp.max(of_l[3 + k], of_r[3 + k])
            corner[k] = wp.max(c[k] - box[k], box[3 + k] - c[k])
        # No body is farther out than those below say, nor than the farthest corner.
        apart = wp.length(d)
        out = wp.max(right * apart + wp.sqrt(l[RADIUS]), left * apart + wp.sqrt(r[RADIUS]))
        q[RADIUS] = wp.min(out * out, wp.dot(corner, corner))
        tree.cell[node] = q
        tree.box[node] = box

    return function(two)


def _adding_square(precision: Precision) -> wp.Function:
    """``add_square(q, part, y)``: second moments with those of a part at y."""
    real, vec3, Cell = precision.scalar, precision.vec3, precision.vector(CELL)

    def add_square(q: Cell, part: real, y: vec3):
        q[SECOND] += part * y[0] * y[0]
        q[SECOND + 1] += part * y[1] * y[1]
        q[SECOND + 2] += part * y[2] * y[2]
        q[SECOND + 3] += part * y[0] * y[1]
        q[SECOND + 4] += part * y[0] * y[2]
        q[SECOND + 5] += part * y[1] * y[2]
        return q

    return function(add_square)


@functools.cache
def moment_kernels(precision: Precision) -> SimpleNamespace:
    """Kernels: ``fill`` the planes by slot, ``sum_up`` the nodes of a level.

    Every node is summed by itself, from its bodies or from the two below it: the order of a sum
    depends on nothing else. Moments are kept over the mass, as lengths squared: products of both
    would leave single precision in SI units.
    """
    real, vec3, Tree = precision.scalar, precision.vec3, tree_type(precision)
    leaf, two = _of_leaf(precision), _of_two(precision)

    @register
    def fill(
        first: int, tree: Tree, own: int, by: wp.array(dtype=wp.int32),
        position: wp.array(dtype=vec3), mass: wp.array(dtype=real),
        softening: wp.array(dtype=real),
    ):  # fmt: skip
        i = first + wp.tid()
        body = by[i]
        tree.order[i] = body
        for k in range(3):
            tree.x[k, i] = position[body][k]
        tree.x[3, i] = mass[body]
        if own != 0:
            tree.x[4, i] = real(0.5) * softening[body] * softening[body]

    @register
    def sum_up(first: int, start: int, tree: Tree):
        node = tree.by_level[start + first + wp.tid()]
        if tree.end[node] - tree.begin[node] <= LEAF:
            leaf(node, tree)
        else:
            two(node, tree)

    return SimpleNamespace(fill=fill, sum_up=sum_up)
