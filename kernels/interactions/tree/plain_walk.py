"""The walk of walk.cpp in Warp's own language, a body at a time."""

import functools
from types import SimpleNamespace

import warp as wp

from ...precision import Precision, function
from .nodes import (
    CELL,
    FORCE,
    LEAF,
    MASS,
    RADIUS,
    SECOND,
    SOFTENING,
    gravity_type,
    out_type,
    tree_type,
)


@functools.cache
def _terms(precision: Precision, what: str) -> SimpleNamespace:
    """What a cell and a body at d add: to the pull, or to depth and to what softening takes off."""
    real, vec3, Cell = precision.scalar, precision.vec3, precision.vector(CELL)
    forces = what == FORCE

    def of_cell(q: Cell, d: vec3, s2: real):
        h = real(1.0) / wp.sqrt(wp.dot(d, d) + s2)
        h2 = h * h
        e = h * d
        s = h2 * vec3(
            q[SECOND] * e[0] + q[SECOND + 3] * e[1] + q[SECOND + 4] * e[2],
            q[SECOND + 3] * e[0] + q[SECOND + 1] * e[1] + q[SECOND + 5] * e[2],
            q[SECOND + 4] * e[0] + q[SECOND + 5] * e[1] + q[SECOND + 2] * e[2],
        )
        along = wp.dot(s, e)
        trace = h2 * (q[SECOND] + q[SECOND + 1] + q[SECOND + 2])
        w = q[MASS] * h
        if wp.static(forces):
            turn = real(3.0) * w * h
            return (w * h + turn * (real(2.5) * along - real(0.5) * trace)) * e - turn * s
        return vec3(
            w + w * (real(1.5) * along - real(0.5) * trace),
            s2 * h2 * (w + w * (real(7.5) * along - real(1.5) * trace)),
            real(0.0),
        )

    def of_body(m: real, d: vec3, s2: real, itself: bool, closest: real):
        r2 = wp.dot(d, d)
        h = real(1.0) / wp.sqrt(wp.max(r2 + s2, closest))
        w = m * h
        if wp.static(forces):
            return wp.where(r2 > closest, w * h, real(0.0)) * (h * d)
        w = wp.where(r2 + s2 > closest and not itself, w, real(0.0))
        return vec3(w, w * (s2 * h * h), real(0.0))

    return SimpleNamespace(of_cell=function(of_cell), of_body=function(of_body))


def plain_walk(precision: Precision, what: str, own: bool) -> wp.Function:
    """``walk(row, c, tree, p, G, o)`` of the body in slot ``row``, which opens as its group c."""
    real, vec3 = precision.scalar, precision.vec3
    Tree, Gravity, Out = tree_type(precision), gravity_type(precision), out_type(precision, what)
    of_cell, of_body = vars(_terms(precision, what)).values()
    forces = what == FORCE

    def walk_body(row: int, c: int, tree: Tree, p: Gravity, G: wp.float64, o: Out):
        g = tree.group[c]
        w, box = tree.world[g], tree.box[g]
        low, high = vec3(box[0], box[1], box[2]), vec3(box[3], box[4], box[5])
        middle = low + real(0.5) * (high - low)
        half = wp.max(middle - low, high - middle)
        x = vec3(tree.x[0, row], tree.x[1, row], tree.x[2, row])
        softening = p.softening_squared
        if wp.static(own):
            softening = tree.x[4, row]
        total = vec3()
        node = tree.root[w]
        while node >= 0:
            q = tree.cell[node]
            center = vec3(q[0], q[1], q[2])
            away = center - middle
            gap = wp.max(wp.max(away, -away) - half, vec3())
            a, b = tree.begin[node], tree.end[node]
            to = node + 1
            if wp.dot(gap, gap) * p.opening_squared > q[RADIUS] + q[SOFTENING]:
                to = tree.next[node]
                total += of_cell(q, center - x, softening + q[SOFTENING])
            elif b - a <= LEAF:
                to = tree.next[node]
                for j in range(a, b):
                    d = vec3(tree.x[0, j], tree.x[1, j], tree.x[2, j]) - x
                    s2 = softening + tree.x[4, j]
                    total += of_body(tree.x[3, j], d, s2, j == row, p.closest_squared)
            node = to
        i = tree.order[row]
        given = G * wp.float64(tree.x[3, row])
        if wp.static(forces):
            for k in range(3):
                o.f[i][k] = o.f[i][k] + real(given * wp.float64(total[k]))
        else:
            depth = wp.float64(total[0])
            o.energy[i] = o.energy[i] - wp.float64(0.5) * given * depth
            o.virial[i] = o.virial[i] - wp.float64(0.5) * given * (depth - wp.float64(total[1]))

    return function(walk_body)
