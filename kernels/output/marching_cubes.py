"""Marching cubes over bricks: a grid that exists only where it is needed.

A brick is a cube of 8 x 8 x 8 nodes; bricks are sorted by their place in the grid, and a node's
number is its brick's times 512 plus its own in the brick. Every node that is inside has all 26
neighbours in some brick, so whatever is in none is outside. A node owns the three edges and the
one cell that go from it towards higher coordinates: vertices on edges come out once, and triangles
share them. The cases are Warp's own (``warp.geometry.IsoSurfaceMarchingCubes``).
"""

import warp as wp
from warp.geometry import IsoSurfaceMarchingCubes as Cubes

from ..precision import register

BRICK = 8  # nodes along a side
NODES = BRICK**3
CORNERS = Cubes.CUBE_CORNER_OFFSETS

# Triangles of a case are RANGES[case]:RANGES[case + 1] of EDGES, three edges each.
RANGES, EDGES = Cubes.CASE_TO_TRI_RANGE, Cubes.TRI_LOCAL_INDICES
# Of each edge of a cell: the corner that owns it, and its axis.
OWNERS = tuple(
    (*CORNERS[a], next(k for k in range(3) if CORNERS[a][k] != CORNERS[b][k]))
    for a, b in Cubes.EDGE_TO_CORNERS
)


@wp.func
def local_place(n: int) -> wp.vec3i:
    """A node's place in its brick."""
    return wp.vec3i((n >> 6) & 7, (n >> 3) & 7, n & 7)


@wp.func
def node_position(bricks: wp.array(dtype=wp.vec3i), n: int, spacing: float) -> wp.vec3:
    """Where a node is."""
    k = 8 * bricks[n >> 9] + local_place(n)
    return spacing * wp.vec3(float(k[0]), float(k[1]), float(k[2]))


@wp.func
def node_beyond(following: wp.array2d(dtype=wp.int32), n: int, i: int, j: int, k: int) -> int:
    """The node 0 or 1 further along each axis, or -1 where there is no brick."""
    at = local_place(n)
    x = at[0] + i
    y = at[1] + j
    z = at[2] + k
    brick = following[n >> 9, (x >> 3) * 4 + (y >> 3) * 2 + (z >> 3)]
    return wp.where(brick < 0, -1, brick * 512 + ((x & 7) * 8 + (y & 7)) * 8 + (z & 7))


@wp.func
def is_inside(inside: wp.array(dtype=wp.uint8), n: int) -> int:
    """1 for nodes in the fluid."""
    result = int(0)
    if n >= 0:
        result = int(inside[n])
    return result


@register
def count_pieces(
    first: int,
    following: wp.array2d(dtype=wp.int32),
    ranges: wp.array(dtype=wp.int32),
    inside: wp.array(dtype=wp.uint8),
    crossed_out: wp.array(dtype=wp.uint8),
    pattern_out: wp.array(dtype=wp.uint8),
    vertices_out: wp.array(dtype=wp.int32),
    triangles_out: wp.array(dtype=wp.int32),
):
    """A node's crossed edges (bits), its cell's case, and how many pieces these make."""
    n = first + wp.tid()
    pattern = int(0)
    for c in range(8):
        corner = node_beyond(
            following, n, wp.static(CORNERS[c][0]), wp.static(CORNERS[c][1]),
            wp.static(CORNERS[c][2]),
        )  # fmt: skip
        pattern += is_inside(inside, corner) << c
    own = pattern & 1
    # Corners 1, 3 and 4 are the ends of the node's own edges.
    crossed = (own ^ ((pattern >> 1) & 1)) + 2 * (own ^ ((pattern >> 3) & 1))
    crossed += 4 * (own ^ ((pattern >> 4) & 1))
    crossed_out[n] = wp.uint8(crossed)
    pattern_out[n] = wp.uint8(pattern)
    vertices_out[n] = (crossed & 1) + ((crossed >> 1) & 1) + (crossed >> 2)
    triangles_out[n] = (ranges[pattern + 1] - ranges[pattern]) / 3


@register
def list_edges(
    first: int,
    crossed: wp.array(dtype=wp.uint8),
    start: wp.array(dtype=wp.int32),
    edges_out: wp.array(dtype=wp.vec2i),
):
    """The crossed edges in order: node and axis."""
    n = first + wp.tid()
    bits = int(crossed[n])
    at = start[n]
    for axis in range(3):
        if ((bits >> axis) & 1) != 0:
            edges_out[at] = wp.vec2i(n, axis)
            at += 1


@wp.func
def vertex_on(
    n: int, axis: int, crossed: wp.array(dtype=wp.uint8), start: wp.array(dtype=wp.int32)
) -> int:
    """The vertex on a node's edge."""
    bits = int(crossed[n]) & ((1 << axis) - 1)
    return start[n] + (bits & 1) + (bits >> 1)


@register
def list_triangles(
    first: int,
    following: wp.array2d(dtype=wp.int32),
    ranges: wp.array(dtype=wp.int32),
    edges: wp.array(dtype=wp.int32),
    owners: wp.array2d(dtype=wp.int32),
    pattern: wp.array(dtype=wp.uint8),
    crossed: wp.array(dtype=wp.uint8),
    vertex_start: wp.array(dtype=wp.int32),
    triangle_start: wp.array(dtype=wp.int32),
    triangles_out: wp.array(dtype=wp.vec3i),
):
    """The triangles of each cell; Warp's cases have the front where values are high."""
    n = first + wp.tid()
    begin = ranges[int(pattern[n])]
    count = (ranges[int(pattern[n]) + 1] - begin) / 3
    for t in range(count):
        triangle = wp.vec3i()
        for s in range(3):
            e = edges[begin + 3 * t + s]
            owner = node_beyond(following, n, owners[e, 0], owners[e, 1], owners[e, 2])
            triangle[2 - s] = vertex_on(owner, owners[e, 3], crossed, vertex_start)
        triangles_out[triangle_start[n] + t] = triangle
