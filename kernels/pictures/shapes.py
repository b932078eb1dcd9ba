"""Rays against shapes: spheres, rounded cones and triangles, in a view's space.

A ray is o + s d. What it hits first is told by the smallest s; ``FAR`` if it misses.
"""

import warp as wp

from ..precision import structure
from .view import FAR

# Shapes are numbered: spheres, then cones, then triangles. Colours and normals likewise: one a
# sphere, one an end of a cone, one a corner of a triangle.
Shapes = structure(
    "Shapes",
    {
        "sphere_count": wp.int32,
        "cone_count": wp.int32,
        "ball": wp.array(dtype=wp.vec4),  # center and radius
        "cone": wp.array(dtype=wp.vec4),  # two ends
        "corner": wp.array(dtype=wp.vec3),  # three a triangle
    },
)


@wp.func
def hit_sphere(o: wp.vec3, d: wp.vec3, c: wp.vec3, r: float, near: float) -> float:
    """Smallest s > near at which o + s d is on the sphere.

    Written with the part of c - o across the ray, which does not cancel for small far spheres.
    """
    m = c - o
    dd = wp.dot(d, d)
    b = wp.dot(m, d) / dd
    across = m - b * d
    h = r * r - wp.dot(across, across)
    s = FAR
    if h > 0.0:
        entry = b - wp.sqrt(h / dd)
        if entry > near:
            s = entry
    return s


@wp.func
def hit_cone(o: wp.vec3, d: wp.vec3, a: wp.vec4, b: wp.vec4, near: float) -> wp.vec2:
    """(s, t): where the ray meets the spheres that go from end a to end b, and which of them.

    Sphere t in 0..1 is at c(t) = c_a + t u, with radius r(t) = r_a + t k. Their envelope is where
    both F = |x - c(t)|^2 - r(t)^2 and dF/dt vanish: t = (m u + r_a k) / w, with m = x - c_a and
    w = u^2 - k^2, hence m^2 - r_a^2 - (m u + r_a k)^2 / w = 0, quadratic in s. What is beyond the
    ends is the end spheres'.
    """
    c_a = wp.vec3(a[0], a[1], a[2])
    c_b = wp.vec3(b[0], b[1], b[2])
    s = hit_sphere(o, d, c_a, a[3], near)
    t = float(0.0)
    end = hit_sphere(o, d, c_b, b[3], near)
    if end < s:
        s = end
        t = 1.0
    u = c_b - c_a
    k = b[3] - a[3]
    w = wp.dot(u, u) - k * k
    if w > 0.0:  # else one end is inside the other
        # From the point of the ray that is nearest to c_a: distant rays would cancel.
        s_0 = wp.dot(c_a - o, d) / wp.dot(d, d)
        m = o + s_0 * d - c_a
        g = wp.dot(m, u) + a[3] * k
        du = wp.dot(d, u)
        A = wp.dot(d, d) - du * du / w
        B = wp.dot(m, d) - g * du / w
        C = wp.dot(m, m) - a[3] * a[3] - g * g / w
        h = B * B - A * C
        if h > 0.0 and A != 0.0:
            root = wp.sqrt(h)
            for sign in range(2):
                e = (-B + (2.0 * float(sign) - 1.0) * root) / A
                t_e = (g + e * du) / w
                if t_e >= 0.0 and t_e <= 1.0 and a[3] + t_e * k > 0.0:
                    if s_0 + e > near and s_0 + e < s:
                        s = s_0 + e
                        t = t_e
    return wp.vec2(s, t)


@wp.func
def hit_triangle(
    o: wp.vec3, d: wp.vec3, a: wp.vec3, b: wp.vec3, c: wp.vec3, near: float
) -> wp.vec3:
    """(s, weight of b, weight of c), by the volumes that the ray makes with the three edges."""
    p = a - o
    q = b - o
    r = c - o
    f = wp.dot(d, wp.cross(q, r))
    g = wp.dot(d, wp.cross(r, p))
    h = wp.dot(d, wp.cross(p, q))
    total = f + g + h
    result = wp.vec3(FAR, 0.0, 0.0)
    # A hair outside counts, so that rounding leaves no cracks between neighbours.
    slack = 1.0e-6 * (wp.abs(f) + wp.abs(g) + wp.abs(h))
    if total > 0.0:
        if wp.min(f, wp.min(g, h)) >= -slack:
            result = wp.vec3(0.0, g / total, h / total)
    if total < 0.0:
        if wp.max(f, wp.max(g, h)) <= slack:
            result = wp.vec3(0.0, g / total, h / total)
    if result[0] == 0.0:
        n = wp.cross(b - a, c - a)
        s = wp.dot(n, p) / wp.dot(n, d)
        if s > near and s < FAR:
            result = wp.vec3(s, result[1], result[2])
        else:
            result = wp.vec3(FAR, 0.0, 0.0)
    return result
