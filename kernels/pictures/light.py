"""Light on what is seen: a sky, a key light with shadows, and how closed in a place is."""

from typing import Any

import warp as wp

from ..precision import structure
from .shapes import hit_cone, hit_triangle
from .view import to_view

# Directions are in the camera's space. Colours are linear.
Light = structure(
    "Light",
    {
        "flat": wp.int32,  # colours as they are, without light
        "key_direction": wp.vec3,  # to the light
        "key": wp.vec3,
        "up": wp.vec3,
        "sky": wp.vec3,  # from above
        "bounce": wp.vec3,  # from below
        "gloss": wp.float32,
        "shadows": wp.int32,
        "texel": wp.float32,  # of the shadow map [length]
        "occlusion": wp.int32,
        "reach": wp.float32,  # how far off things close a place in [length]
        "background": wp.vec3,
        "ground": wp.vec3,
        "outside": wp.float32,  # distance from the center at which nothing is near [length]
        "center": wp.vec3,  # of the scene, in the camera's space
        "fade": wp.float32,  # distance from there at which the ground ends [length]
    },
)


@wp.func
def blend(a: wp.vec3, b: wp.vec3, t: float) -> wp.vec3:
    """From a at 0 to b at 1."""
    return (1.0 - t) * a + t * b


@wp.func
def facing(n: wp.vec3, d: wp.vec3) -> wp.vec3:
    """A normal of length 1 on the side that a ray comes from."""
    u = wp.normalize(n)
    if wp.dot(u, d) > 0.0:
        u = -u
    return u


@wp.func
def surface(
    view: Any,
    shapes: Any,
    normal: wp.array(dtype=wp.vec3),
    color: wp.array(dtype=wp.vec3),
    shape: int,
    o: wp.vec3,
    d: wp.vec3,
    s: float,
):
    """Normal in the view's space and colour of a shape where a ray meets it."""
    x = o + s * d
    n = wp.vec3(0.0, 0.0, 1.0)
    tint = wp.vec3(0.0, 0.0, 0.0)
    cones = shapes.sphere_count
    triangles = shapes.sphere_count + shapes.cone_count
    if shape < cones:
        ball = shapes.ball[shape]
        n = wp.normalize(x - wp.vec3(ball[0], ball[1], ball[2]))
        tint = color[shape]
    elif shape < triangles:
        e = 2 * (shape - cones)
        a = shapes.cone[e]
        b = shapes.cone[e + 1]
        t = hit_cone(o, d, a, b, view.near)[1]
        c = (1.0 - t) * a + t * b
        n = wp.normalize(x - wp.vec3(c[0], c[1], c[2]))
        tint = blend(color[cones + e], color[cones + e + 1], t)
    else:
        v = 3 * (shape - triangles)
        a_x = shapes.corner[v]
        b_x = shapes.corner[v + 1]
        c_x = shapes.corner[v + 2]
        met = hit_triangle(o, d, a_x, b_x, c_x, view.near)
        w = 1.0 - met[1] - met[2]
        smooth = w * normal[v] + met[1] * normal[v + 1] + met[2] * normal[v + 2]
        n = wp.vec3(wp.dot(view.right, smooth), wp.dot(view.up, smooth), wp.dot(view.back, smooth))
        if wp.dot(n, n) < 1.0e-12:
            n = wp.cross(b_x - a_x, c_x - a_x)
        n = facing(n, d)
        base = cones + 2 * shapes.cone_count + v
        tint = w * color[base] + met[1] * color[base + 1] + met[2] * color[base + 2]
    return n, tint


@wp.func
def lit_part(
    sun: Any, depth: wp.array2d(dtype=wp.float32), light: Any, x: wp.vec3, n: wp.vec3
) -> float:
    """How much of the key light reaches a point of the scene: 4 texels of the shadow map, smooth.

    The point is moved off its surface by more than a texel, which would else shade itself.
    """
    q = to_view(sun, x + 2.0 * light.texel * n)
    column = (sun.slope[0] + q[0]) / sun.sample[0] - 1.0
    row = (sun.slope[1] - q[1]) / sun.sample[1] - 1.0
    i = int(wp.floor(column))
    j = int(wp.floor(row))
    f = column - float(i)
    g = row - float(j)
    lit = float(0.0)
    if i < 0 or j < 0 or i + 2 >= sun.width or j + 2 >= sun.height:
        lit = 4.0
    else:
        for b in range(3):
            across = float(1.0)
            if b == 0:
                across = 1.0 - g
            if b == 2:
                across = g
            for a in range(3):
                along = float(1.0)
                if a == 0:
                    along = 1.0 - f
                if a == 2:
                    along = f
                if depth[j + b, i + a] + light.texel > -q[2]:
                    lit += across * along
    return 0.25 * lit


@wp.func
def shine(light: Any, n: wp.vec3, d: wp.vec3, tint: wp.vec3, lit: float, open: float) -> wp.vec3:
    """Light that leaves a surface along -d: sky and bounce by height of the normal, and the key."""
    ambient = open * blend(light.bounce, light.sky, 0.5 + 0.5 * wp.dot(n, light.up))
    cosine = wp.max(wp.dot(n, light.key_direction), 0.0) * lit
    h = wp.normalize(light.key_direction - wp.normalize(d))
    shiny = wp.max(wp.dot(n, h), 0.0)
    for _ in range(5):
        shiny *= shiny  # to the power of 32, much faster than by pow
    gloss = light.gloss * shiny * cosine
    return wp.cw_mul(tint, ambient + cosine * light.key) + gloss * light.key
