"""Pixels from samples: how closed in each is, its light, the veils before it, and its sRGB."""

import warp as wp

from ..precision import register
from .draw import GROUND, NOTHING
from .light import Light, blend, facing, lit_part, shine, surface
from .shapes import Shapes, hit_triangle
from .view import FAR, TILE, View, from_view, on_screen, ray_direction, ray_origin


@register
def find_occlusion(
    first: int,
    view: View,
    shapes: Shapes,
    light: Light,
    normal: wp.array(dtype=wp.vec3),
    color: wp.array(dtype=wp.vec3),
    ground: wp.vec3,
    spiral: wp.array2d(dtype=wp.vec2),
    step: int,
    depth: wp.array2d(dtype=wp.float32),
    shape: wp.array2d(dtype=wp.int32),
    open_out: wp.array2d(dtype=wp.float32),
):
    """A pixel of ``step`` x ``step`` samples: how open to the sky what they show is, 0..1.

    Looks at places around on the screen, by a ``spiral`` in the unit disk, turned differently in
    each of 4 x 4 pixels: what rises above the surface there, within reach, takes its part of the
    sky.
    """
    pixel = first + wp.tid()
    j = pixel / open_out.shape[1]
    i = pixel % open_out.shape[1]
    row = j * step
    column = i * step
    z = depth[row, column]
    seen = shape[row, column]
    opening = float(1.0)
    at = on_screen(view, float(column) + 0.5, float(row) + 0.5)
    o = ray_origin(view, at)
    d = ray_direction(view, at)
    if seen == GROUND:
        if wp.length(o + z * d - light.center) > light.outside:
            seen = NOTHING  # nothing near that could close it in
    if seen != NOTHING:
        n = ground
        if seen != GROUND:
            n, _tint = surface(view, shapes, normal, color, seen, o, d, z)
        x = o + z * d
        radius = light.reach / (view.sample[1] * z)
        radius = wp.clamp(radius, 3.0, 0.1 * float(view.height))
        turn = (i % 4) * 4 + j % 4
        taken = float(0.0)
        for k in range(spiral.shape[1]):
            to = radius * spiral[turn, k]
            a = column + int(to[0])
            b = row + int(to[1])
            if a >= 0 and b >= 0 and a < view.width and b < view.height:
                there = on_screen(view, float(a) + 0.5, float(b) + 0.5)
                v = ray_origin(view, there) + depth[b, a] * ray_direction(view, there) - x
                square = wp.dot(v, v)
                if square < light.reach * light.reach and square > 0.0:
                    rise = wp.dot(v, n) / wp.sqrt(square) - 0.1
                    far = square / (light.reach * light.reach)
                    taken += wp.max(rise, 0.0) * (1.0 - far)
        opening = wp.max(1.0 - 2.5 * taken / float(spiral.shape[1]), 0.0)
    open_out[j, i] = opening


@wp.func
def smooth_opening(
    open: wp.array2d(dtype=wp.float32),
    depth: wp.array2d(dtype=wp.float32),
    j: int,
    i: int,
    step: int,
    z: float,
    reach: float,
) -> float:
    """Mean of 4 x 4 pixels that are about as deep: each turn of the spiral once."""
    total = float(0.0)
    weight = float(0.0)
    for b in range(wp.max(j - 2, 0), wp.min(j + 2, open.shape[0])):
        for a in range(wp.max(i - 2, 0), wp.min(i + 2, open.shape[1])):
            if wp.abs(depth[b * step, a * step] - z) < 0.3 * reach:
                total += open[b, a]
                weight += 1.0
    mean = open[j, i]
    if weight > 0.0:
        mean = total / weight
    return mean


@wp.func
def encode(c: float) -> wp.uint8:
    """Linear light to the 8 bits of sRGB (IEC 61966-2-1)."""
    x = wp.clamp(c, 0.0, 1.0)
    y = 12.92 * x
    if x > 0.0031308:
        y = 1.055 * wp.pow(x, 0.41666667) - 0.055
    return wp.uint8(255.0 * y + 0.5)


@register
def shade_pixels(
    first: int,
    view: View,
    sun: View,
    shapes: Shapes,
    light: Light,
    normal: wp.array(dtype=wp.vec3),
    color: wp.array(dtype=wp.vec3),
    ground: wp.vec3,
    step: int,
    depth: wp.array2d(dtype=wp.float32),
    shape: wp.array2d(dtype=wp.int32),
    sun_depth: wp.array2d(dtype=wp.float32),
    open: wp.array2d(dtype=wp.float32),
    color_out: wp.array2d(dtype=wp.vec3),
):
    """A pixel of ``step`` x ``step`` samples: linear light, each shape in it shaded once."""
    pixel = first + wp.tid()
    j = pixel / color_out.shape[1]
    i = pixel % color_out.shape[1]
    total = wp.vec3(0.0, 0.0, 0.0)
    last = int(NOTHING)
    shaded = wp.vec3(0.0, 0.0, 0.0)
    for k in range(step * step):
        row = j * step + k / step
        column = i * step + k % step
        seen = shape[row, column]
        if seen == NOTHING:
            shaded = light.background
        elif seen != last:
            at = on_screen(view, float(column) + 0.5, float(row) + 0.5)
            o = ray_origin(view, at)
            d = ray_direction(view, at)
            z = depth[row, column]
            x = o + z * d
            n = ground
            tint = light.ground
            if seen != GROUND:
                n, tint = surface(view, shapes, normal, color, seen, o, d, z)
            shaded = tint
            if light.flat == 0:
                lit = float(1.0)
                if light.shadows != 0 and wp.dot(n, light.key_direction) > 0.0:
                    raised = n[0] * view.right + n[1] * view.up + n[2] * view.back
                    lit = lit_part(sun, sun_depth, light, from_view(view, x), raised)
                opening = float(1.0)
                if light.occlusion != 0:
                    opening = smooth_opening(open, depth, j, i, step, z, light.reach)
                shaded = shine(light, n, d, tint, lit, opening)
            if seen == GROUND:
                off = wp.length(x - light.center) / light.fade
                shaded = blend(shaded, light.background, wp.smoothstep(0.3, 1.0, off))
        last = seen
        total += shaded
    color_out[j, i] = total / float(step * step)


@register
def veil_pixels(
    first: int,
    view: View,
    light: Light,
    corner: wp.array(dtype=wp.vec3),
    color: wp.array(dtype=wp.vec3),
    opacity: wp.array(dtype=wp.float32),
    start: wp.array(dtype=wp.int32),
    listed: wp.array(dtype=wp.int32),
    step: int,
    depth: wp.array2d(dtype=wp.float32),
    color_io: wp.array2d(dtype=wp.vec3),
):
    """A pixel behind clear triangles. Several veils take their mean colour, in any order."""
    pixel = first + wp.tid()
    j = pixel / color_io.shape[1]
    i = pixel % color_io.shape[1]
    half = 0.5 * float(step)
    tile = (j * step / TILE) * view.tiles_x + i * step / TILE
    passed = float(1.0)
    tint = wp.vec3(0.0, 0.0, 0.0)
    weight = float(0.0)
    if start[tile] < start[tile + 1]:
        at = on_screen(view, float(i * step) + half, float(j * step) + half)
        o = ray_origin(view, at)
        d = ray_direction(view, at)
        for k in range(start[tile], start[tile + 1]):
            t = listed[k]
            a = corner[3 * t]
            b = corner[3 * t + 1]
            c = corner[3 * t + 2]
            met = hit_triangle(o, d, a, b, c, view.near)
            if met[0] < FAR:
                before = float(0.0)
                for m in range(step * step):
                    if met[0] < depth[j * step + m / step, i * step + m % step]:
                        before += 1.0
                veil = opacity[t] * before / float(step * step)
                n = facing(wp.cross(b - a, c - a), d)
                seen = color[t]
                if light.flat == 0:
                    seen = shine(light, n, d, seen, 1.0, 1.0)
                passed *= 1.0 - veil
                tint += veil * seen
                weight += veil
    if weight > 0.0:
        color_io[j, i] = passed * color_io[j, i] + (1.0 - passed) * (tint / weight)


@register
def encode_pixels(
    first: int,
    color: wp.array2d(dtype=wp.vec3),
    pixel_out: wp.array3d(dtype=wp.uint8),
):
    """A pixel as sRGB."""
    pixel = first + wp.tid()
    j = pixel / color.shape[1]
    i = pixel % color.shape[1]
    c = color[j, i]
    for k in range(3):
        pixel_out[j, i, k] = encode(c[k])
