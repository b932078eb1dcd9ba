"""Walks through a tree: what the bodies of a group feel of all others, of cells and of bodies.

A cell far from the box around the group, r > b / theta with b its radius and theta the opening
angle, acts by its mass and its second moments s = sum m_j y_j y_j / M about its centre of mass, at
d from a body and with u^2 = d^2 + S^2 (Hernquist 1987; where there is softening, the trace of s
counts):

    phi = -M [1/u + 3/2 d.s.d / u^5 - 1/2 tr s / u^3],  a = grad_d phi.

A cell that is near is opened, and a leaf's bodies act one by one. All bodies of a group share one
list of both (Barnes 1990), so that the loops over it are contiguous.
"""

import functools

import warp as wp

from ...engine.lanes import lane_count
from ...engine.packed import FAR, FLAGS
from ...native import body
from ...precision import Precision, native, register
from ...warp_internals import columns
from .nodes import (
    CELL,
    FORCE,
    GROUP,
    LEAF,
    MEASURE,
    RADIUS,
    SOFTENING,
    gravity_type,
    out_type,
    tree_type,
)
from .plain_walk import plain_walk

LIST = 512  # entries of a list that are summed at a time
# What is stored of the sums, by particle, with G m_i.
_STORED = {
    FORCE: "for (int n = 0; n < 3; ++n) f[3 * particle + n] += (real)(given * total[n]);",
    MEASURE: "energy[particle] -= 0.5 * given * total[0]; "
    "virial[particle] -= 0.5 * given * (total[0] - total[1]);",
}


@functools.cache
def walk_kernel(precision: Precision, what: str, own: bool, vectorised: bool) -> wp.Kernel:
    """Kernel over groups, or over slots where it is not vectorised: add what the bodies feel.

    Args:
        precision: Of the sums.
        what: ``FORCE``, or ``MEASURE``: of each body its energy and virial.
        own: Whether each body has a softening of its own.
        vectorised: In C++ for the CPU's vector units.
    """
    Tree, Gravity, Out = tree_type(precision), gravity_type(precision), out_type(precision, what)
    walk = (_native if vectorised else plain_walk)(precision, what, own)
    flags = FLAGS["fused"] if vectorised else ""

    @functools.partial(register, cpu_only=vectorised, flags=flags)
    def walk_tree(first: int, tree: Tree, parameters: wp.array(dtype=Gravity), o: Out):
        row = first + wp.tid()
        c = row
        if wp.static(not vectorised):
            c = tree.group_of[row]
        p = parameters[tree.world[tree.group[c]]]
        walk(row, c, tree, p, wp.float64(p.constant), o)

    return walk_tree


def _native(precision: Precision, what: str, own: bool) -> wp.Function:
    """``walk(row, c, tree, p, G, o)`` of all bodies of group c."""
    Tree, Gravity, Out = tree_type(precision), gravity_type(precision), out_type(precision, what)
    numbers = {
        "W": lane_count(precision), "GROUP": GROUP, "LIST": LIST, "CELL": CELL, "OWN": own,
        "MEASURE": what == MEASURE, "SUMS": 2 if what == MEASURE else 3, "AT_ONCE": 4,
        "LEAF": LEAF, "RADIUS": RADIUS, "SOFTENING": SOFTENING,
    }  # fmt: skip
    arrays = {
        "x": "tree.x", "cell_of": "tree.cell", "boxes": "tree.box",
        **{f"int* {name}": f"tree.{name}" for name in
           ("begin", "end", "next", "world", "root", "group", "order")},
        **({"f": "o.f"} if what == FORCE else
           {"double* energy": "o.energy", "double* virial": "o.virial"}),
    }  # fmt: skip
    macros = {
        "stride": f"((long long){columns('tree.x')})",
        "STORE": _STORED[what],
        "FAR": FAR[precision.c],
    }
    snippet = body("interactions/tree/walk.cpp", precision, numbers, arrays, macros)

    def walk_group(row: int, c: int, tree: Tree, p: Gravity, G: wp.float64, o: Out): ...

    return native(walk_group, snippet, after_gradients=False)
