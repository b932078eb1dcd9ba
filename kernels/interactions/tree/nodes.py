"""A tree of bodies: what it holds on the device.

Bodies stand in *slots*, in an order in which the bodies of every node follow each other. A node is
halved at its median body, so which slots it has, and which nodes are below it, is known from the
number of bodies alone and never changes; what changes is which body stands in which slot. Nodes
are in the order of a walk that opens all: the lower half of node k is k + 1, the upper the next of
that.
"""

from typing import Any

import warp as wp

from ...precision import Precision, structure

LEAF = 8  # bodies of a node that is not halved
GROUP = 64  # bodies that share a walk; with these and quadrupoles the fastest, as measured
# Numbers of a cell: centre of mass, mass, the second moments xx, yy, zz, xy, xz, yz over the mass,
# the square of the greatest distance of a body from the centre, and half the mean square of their
# softenings.
CELL = 12
MASS, SECOND, RADIUS, SOFTENING = 3, 4, 10, 11
PLANES = 5  # x, y, z, mass, half the square of the softening
PADDING = 16  # planes may be read beyond their end
FORCE, MEASURE = "force", "measure"  # what a walk is made for


def tree_type(precision: Precision) -> Any:
    """The trees of all worlds."""
    integers = wp.array(dtype=wp.int32)
    fields = {
        "begin": integers,  # node -> first slot
        "end": integers,  # node -> last slot + 1
        "next": integers,  # node -> where a walk goes on that does not open it, or -1
        "by_level": integers,  # the nodes, those of a level together
        "world": integers,  # node -> world
        "root": integers,  # world -> node
        "group": integers,  # group -> node
        "group_of": integers,  # slot -> group
        "order": integers,  # slot -> particle
        "x": wp.array2d(dtype=precision.scalar),  # the planes by slot
        "cell": wp.array(dtype=precision.vector(CELL)),  # by node
        "box": wp.array(dtype=precision.vector(6)),  # by node: lower and upper corner
    }
    return structure(f"Tree_{precision.name}", fields)


def gravity_type(precision: Precision) -> Any:
    """Parameters of a world's gravity."""
    names = ("constant", "softening_squared", "closest_squared", "opening_squared")
    return structure(f"TreeGravity_{precision.name}", dict.fromkeys(names, precision.scalar))


def out_type(precision: Precision, what: str) -> Any:
    """What a walk adds to: the forces, or the energy and the virial of each particle."""
    if what == FORCE:
        return structure("TreeForce", {"f": wp.array(dtype=precision.vec3)})
    doubles = wp.array(dtype=wp.float64)
    return structure("TreeMeasure", {"energy": doubles, "virial": doubles})
