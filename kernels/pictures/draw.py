"""What is seen where: the nearest shape of every sample, tile by tile."""

import warp as wp

from ..precision import register
from .shapes import Shapes, hit_cone, hit_sphere, hit_triangle
from .view import FAR, TILE, View, on_screen, ray_direction, ray_origin

NOTHING = wp.constant(-1)
GROUND = wp.constant(-2)
LOOK = wp.constant(8)  # shapes between two looks at whether a tile is full


@wp.func
def farthest(depth: wp.array2d(dtype=wp.float32), left: int, top: int, right: int, bottom: int):
    """Largest depth of a rectangle of samples."""
    z = float(0.0)
    for row in range(top, bottom):
        for column in range(left, right):
            z = wp.max(z, depth[row, column])
    return z


@register
def clear_tiles(
    first: int,
    view: View,
    normal: wp.vec3,
    height: float,
    depth_out: wp.array2d(dtype=wp.float32),
    shape_out: wp.array2d(dtype=wp.int32),
):
    """Samples of a tile: nothing, or the ground, a plane ``height`` below the camera.

    Its normal is in the view's space; zero for no ground.
    """
    tile = first + wp.tid()
    left = (tile % view.tiles_x) * TILE
    top = (tile / view.tiles_x) * TILE
    for row in range(top, wp.min(top + TILE, view.height)):
        for column in range(left, wp.min(left + TILE, view.width)):
            d = ray_direction(view, on_screen(view, float(column) + 0.5, float(row) + 0.5))
            depth = FAR
            shape = NOTHING
            fall = -wp.dot(normal, d)
            if height > 0.0 and fall * FAR > height:
                depth = height / fall
                shape = GROUND
            depth_out[row, column] = depth
            shape_out[row, column] = shape


@register
def draw_tiles(
    first: int,
    view: View,
    shapes: Shapes,
    box: wp.array(dtype=wp.vec4i),
    nearest: wp.array(dtype=wp.float32),
    start: wp.array(dtype=wp.int32),
    listed: wp.array(dtype=wp.int32),
    depth_io: wp.array2d(dtype=wp.float32),
    shape_io: wp.array2d(dtype=wp.int32),
):
    """Draw the shapes of a tile into its samples, each where it is nearer than what is there.

    They come about from near to far, so that many find their samples taken.
    """
    tile = first + wp.tid()
    left = (tile % view.tiles_x) * TILE
    top = (tile / view.tiles_x) * TILE
    right = wp.min(left + TILE, view.width)
    bottom = wp.min(top + TILE, view.height)
    cones = shapes.sphere_count
    triangles = shapes.sphere_count + shapes.cone_count
    begin = start[tile]
    wall = FAR  # nothing farther than this is seen
    for k in range(begin, start[tile + 1]):
        if (k - begin) % LOOK == LOOK - 1:
            wall = farthest(depth_io, left, top, right, bottom)
        i = listed[k]
        near = nearest[i]
        if near < wall:
            b = box[i]
            for row in range(wp.max(b[1], top), wp.min(b[3], bottom)):
                for column in range(wp.max(b[0], left), wp.min(b[2], right)):
                    z = depth_io[row, column]
                    if near < z:
                        at = on_screen(view, float(column) + 0.5, float(row) + 0.5)
                        o = ray_origin(view, at)
                        d = ray_direction(view, at)
                        s = FAR
                        if i < cones:
                            c = shapes.ball[i]
                            s = hit_sphere(o, d, wp.vec3(c[0], c[1], c[2]), c[3], view.near)
                        elif i < triangles:
                            e = 2 * (i - cones)
                            hit = hit_cone(o, d, shapes.cone[e], shapes.cone[e + 1], view.near)
                            s = hit[0]
                        else:
                            v = 3 * (i - triangles)
                            met = hit_triangle(
                                o, d, shapes.corner[v], shapes.corner[v + 1],
                                shapes.corner[v + 2], view.near,
                            )  # fmt: skip
                            s = met[0]
                        if s < z:
                            depth_io[row, column] = s
                            shape_io[row, column] = i
