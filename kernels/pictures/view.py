"""From a scene to a screen: views, where shapes are on the screen, and lists of shapes by tile.

A view is a pinhole camera, or a parallel one for the shadow map. In its space it looks along -z
from the origin, and the depth of a point is -z. The screen is cut into square tiles of ``TILE``
samples. A shape finds the box of samples that it can touch; the pairs (tile, shape) are sorted by
tile, and whoever draws a tile goes through its own shapes only.
"""

from typing import Any

import warp as wp

from ..precision import register, structure

TILE = wp.constant(16)
FAR = wp.constant(1.0e30)  # depth where there is nothing

View = structure(
    "View",
    {
        "right": wp.vec3,
        "up": wp.vec3,
        "back": wp.vec3,
        "eye": wp.vec3,
        "slope": wp.vec2,  # half the screen at depth 1; of a parallel view, half the screen
        "sample": wp.vec2,  # a sample's part of that
        "width": wp.int32,  # samples
        "height": wp.int32,
        "tiles_x": wp.int32,
        "near": wp.float32,
        "least": wp.float32,  # radius of the smallest spheres at depth 1
        "parallel": wp.float32,  # 1 or 0
    },
)


@wp.func
def to_view(view: Any, x: wp.vec3) -> wp.vec3:
    """A point of the scene in the view's space."""
    d = x - view.eye
    return wp.vec3(wp.dot(view.right, d), wp.dot(view.up, d), wp.dot(view.back, d))


@wp.func
def from_view(view: Any, p: wp.vec3) -> wp.vec3:
    """A point of the view's space in the scene."""
    return view.eye + p[0] * view.right + p[1] * view.up + p[2] * view.back


@wp.func
def on_screen(view: Any, column: float, row: float) -> wp.vec2:
    """Where a sample is on the screen at depth 1; half numbers are the middles of samples."""
    u = column * view.sample[0] - view.slope[0]
    v = view.slope[1] - row * view.sample[1]
    return wp.vec2(u, v)


@wp.func
def ray_origin(view: Any, at: wp.vec2) -> wp.vec3:
    """Where the ray of a place on the screen starts."""
    # A product, for vectors under an "if" made the loops around four times slower on the CPU.
    return wp.vec3(view.parallel * at[0], view.parallel * at[1], 0.0)


@wp.func
def ray_direction(view: Any, at: wp.vec2) -> wp.vec3:
    """Its direction; not of length 1, but 1 deep, so that ray parameters are depths."""
    spread = 1.0 - view.parallel
    return wp.vec3(spread * at[0], spread * at[1], -1.0)


@wp.func
def span(x: float, z: float, r: float) -> wp.vec2:
    """Slopes x / depth that a circle at (x, depth z) of radius r is between, seen from the origin.

    The tangents are at the angles atan(x / z) -+ asin(r / |(x, z)|).
    """
    low = -FAR
    high = FAR
    tangent = x * x + z * z - r * r
    if tangent > 0.0:
        t = wp.sqrt(tangent)
        if z * t + r * x > 0.0:
            low = (x * t - r * z) / (z * t + r * x)
        if z * t - r * x > 0.0:
            high = (x * t + r * z) / (z * t - r * x)
    return wp.vec2(low, high)


@wp.func
def sphere_reach(view: Any, c: wp.vec3, r: float) -> wp.vec4:
    """The part of the screen that a sphere is within: lowest u and v, highest u and v."""
    reach = wp.vec4(c[0] - r, c[1] - r, c[0] + r, c[1] + r)
    if view.parallel == 0.0:
        u = span(c[0], -c[2], r)
        v = span(c[1], -c[2], r)
        reach = wp.vec4(u[0], v[0], u[1], v[1])
    return reach


@wp.func
def sample_box(view: Any, reach: wp.vec4) -> wp.vec4i:
    """Samples whose middles a part of the screen can hold: columns and rows, first and end."""
    w = float(view.width)
    h = float(view.height)
    # Half a sample more than needed: rounding must not cut.
    left = (view.slope[0] + reach[0]) / view.sample[0] - 1.0
    right = (view.slope[0] + reach[2]) / view.sample[0] + 1.0
    top = (view.slope[1] - reach[3]) / view.sample[1] - 1.0
    bottom = (view.slope[1] - reach[1]) / view.sample[1] + 1.0
    return wp.vec4i(
        int(wp.clamp(left, 0.0, w)),
        int(wp.clamp(top, 0.0, h)),
        int(wp.clamp(right, 0.0, w)),
        int(wp.clamp(bottom, 0.0, h)),
    )


@wp.func
def tile_count(box: wp.vec4i) -> int:
    """How many tiles a box of samples touches."""
    count = int(0)
    if box[2] > box[0]:
        if box[3] > box[1]:
            columns = (box[2] - 1) / TILE - box[0] / TILE + 1
            rows = (box[3] - 1) / TILE - box[1] / TILE + 1
            count = columns * rows
    return count


@register
def place_spheres(
    first: int,
    view: View,
    ball: wp.array(dtype=wp.vec4),
    ball_out: wp.array(dtype=wp.vec4),
    box_out: wp.array(dtype=wp.vec4i),
    nearest_out: wp.array(dtype=wp.float32),
    count_out: wp.array(dtype=wp.int32),
):
    """Spheres (x, y, z, radius) in the view's space, and their samples."""
    i = first + wp.tid()
    b = ball[i]
    c = to_view(view, wp.vec3(b[0], b[1], b[2]))
    # What is smaller than a pixel would be seen in some frames and not in others.
    r = wp.max(b[3], -c[2] * view.least)
    ball_out[i] = wp.vec4(c[0], c[1], c[2], r)
    box = wp.vec4i(0, 0, 0, 0)
    if b[3] > 0.0 and -c[2] + r > view.near:
        box = sample_box(view, sphere_reach(view, c, r))
    box_out[i] = box
    nearest_out[i] = -c[2] - r
    count_out[i] = tile_count(box)


@register
def place_cones(
    first: int,
    view: View,
    offset: int,
    cone: wp.array(dtype=wp.vec4),
    cone_out: wp.array(dtype=wp.vec4),
    box_out: wp.array(dtype=wp.vec4i),
    nearest_out: wp.array(dtype=wp.float32),
    count_out: wp.array(dtype=wp.int32),
):
    """Rounded cones, two ends (x, y, z, radius) each; ``offset`` shapes come before them."""
    i = first + wp.tid()
    a = cone[2 * i]
    b = cone[2 * i + 1]
    p = to_view(view, wp.vec3(a[0], a[1], a[2]))
    q = to_view(view, wp.vec3(b[0], b[1], b[2]))
    cone_out[2 * i] = wp.vec4(p[0], p[1], p[2], a[3])
    cone_out[2 * i + 1] = wp.vec4(q[0], q[1], q[2], b[3])
    box = wp.vec4i(0, 0, 0, 0)
    nearest = wp.min(-p[2] - a[3], -q[2] - b[3])
    farthest = wp.max(-p[2] + a[3], -q[2] + b[3])
    if wp.max(a[3], b[3]) > 0.0 and farthest > view.near:
        if nearest > view.near or view.parallel != 0.0:
            # What is around both ends is around what is between them.
            s = sphere_reach(view, p, a[3])
            t = sphere_reach(view, q, b[3])
            low = wp.min(wp.vec2(s[0], s[1]), wp.vec2(t[0], t[1]))
            high = wp.max(wp.vec2(s[2], s[3]), wp.vec2(t[2], t[3]))
            box = sample_box(view, wp.vec4(low[0], low[1], high[0], high[1]))
        else:
            box = wp.vec4i(0, 0, view.width, view.height)
    box_out[offset + i] = box
    nearest_out[offset + i] = nearest
    count_out[offset + i] = tile_count(box)


@register
def place_triangles(
    first: int,
    view: View,
    offset: int,
    corner: wp.array(dtype=wp.vec3),
    corner_out: wp.array(dtype=wp.vec3),
    box_out: wp.array(dtype=wp.vec4i),
    nearest_out: wp.array(dtype=wp.float32),
    count_out: wp.array(dtype=wp.int32),
):
    """Triangles, three corners each; ``offset`` shapes come before them."""
    i = first + wp.tid()
    low = wp.vec3(FAR, FAR, FAR)
    high = wp.vec3(-FAR, -FAR, -FAR)
    for k in range(3):
        p = to_view(view, corner[3 * i + k])
        corner_out[3 * i + k] = p
        z = -p[2]
        s = wp.vec3(p[0], p[1], z)
        if view.parallel == 0.0:
            s = wp.vec3(p[0] / wp.max(z, view.near), p[1] / wp.max(z, view.near), z)
        low = wp.min(low, s)
        high = wp.max(high, s)
    box = wp.vec4i(0, 0, 0, 0)
    if high[2] > view.near:
        if low[2] > view.near or view.parallel != 0.0:
            box = sample_box(view, wp.vec4(low[0], low[1], high[0], high[1]))
        else:
            box = wp.vec4i(0, 0, view.width, view.height)
    box_out[offset + i] = box
    nearest_out[offset + i] = low[2]
    count_out[offset + i] = tile_count(box)


@wp.func
def depth_rank(z: float, bits: int) -> wp.uint32:
    """A number of so many bits that grows with depth, in equal steps of its logarithm.

    Positive floats are in the order of their bits.
    """
    return wp.cast(wp.max(z, 1.0e-30), wp.uint32) >> wp.uint32(31 - bits)


@register
def list_tiles(
    first: int,
    start: int,
    tiles_x: int,
    depth_bits: int,
    box: wp.array(dtype=wp.vec4i),
    nearest: wp.array(dtype=wp.float32),
    place: wp.array(dtype=wp.int32),
    key_out: wp.array(dtype=wp.uint32),
    shape_out: wp.array(dtype=wp.int32),
):
    """The pairs (tile and depth, shape) of the shapes from ``start`` on, at their places."""
    i = first + wp.tid()
    b = box[start + i]
    k = place[i]
    rank = depth_rank(nearest[start + i], depth_bits)
    if tile_count(b) > 0:
        for row in range(b[1] / TILE, (b[3] - 1) / TILE + 1):
            for column in range(b[0] / TILE, (b[2] - 1) / TILE + 1):
                tile = wp.uint32(row * tiles_x + column)
                key_out[k] = (tile << wp.uint32(depth_bits)) | rank
                shape_out[k] = start + i
                k += 1


@register
def find_tiles(
    first: int,
    pair_count: int,
    depth_bits: int,
    key: wp.array(dtype=wp.uint32),
    start_out: wp.array(dtype=wp.int32),
):
    """Where the pairs of each tile start in the sorted list, by bisection."""
    t = first + wp.tid()
    low = int(0)
    high = int(pair_count)
    while low < high:
        middle = (low + high) / 2
        if int(key[middle] >> wp.uint32(depth_bits)) < t:
            low = middle + 1
        else:
            high = middle
    start_out[t] = low
