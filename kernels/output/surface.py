"""A fluid's surface: kernels that stretch along it, and the field that they sum to.

After Yu and Turk 2013 ("Reconstructing surfaces of particle-based fluids using anisotropic
kernels"). All lengths are in smoothing lengths, so that every sum reaches ``REACH`` = 2:

    phi(r) = sum_j V_j det(G_j) W(|G_j (r - c_j)|)

with the volumes V_j = m_j / rho_j, smoothed centres c_j, and stretches G_j, the inverse of the
weighted covariance of the particles around. The fluid is where phi is at least a level.
"""

import warp as wp

from ..precision import register, structure
from .marching_cubes import node_position

REACH = wp.constant(2.0)
CORE = wp.constant(0.4)  # where the first look is: mostly one cell, which will do deep inside
NEARLY = wp.constant(0.01)  # of a spacing
# Variance along an axis of a full neighbourhood, by the weights 1 - (r/2)^3: 4 * 0.15.
FULL = wp.constant(0.6)

Shaping = structure(
    "Shaping",
    {
        "smoothing": wp.float32,  # of the centres: lambda
        "flattest": wp.float32,  # least ratio of a kernel's axes: 1 / k_r
        "fewest": wp.int32,  # neighbours, N_epsilon; with fewer a particle is on its own
        "alone": wp.float32,  # scale of the kernel of such a one, k_n; no axis is shorter
    },
)
Blobs = structure(
    "Blobs",
    {
        "center": wp.array(dtype=wp.vec3),
        "stretch": wp.array(dtype=wp.mat33),  # G
        "weight": wp.array(dtype=wp.float32),  # V det(G), over W's normalisation
    },
)


@wp.func
def wendland(q: float) -> float:
    """W of Wendland C2 without its normalisation, which cancels against that of the density."""
    s = wp.max(1.0 - 0.5 * q, 0.0)
    return s * s * s * s * (1.0 + 2.0 * q)


@wp.func
def wendland_slope(q: float) -> float:
    """W'(q) / q."""
    s = wp.max(1.0 - 0.5 * q, 0.0)
    return -5.0 * s * s * s


@wp.func
def axes(covariance: wp.mat33, p: Shaping):
    """Directions and lengths of a kernel's axes, from a covariance over that of the full."""
    directions, lengths = wp.eig3(covariance)
    least = wp.max(wp.max(lengths) * p.flattest, p.alone)
    for a in range(3):
        lengths[a] = wp.clamp(lengths[a], least, 1.0)
    return directions, lengths


@register
def shape_blobs(
    first: int,
    p: Shaping,
    grid: wp.uint64,
    x: wp.array(dtype=wp.vec3),
    mass: wp.array(dtype=wp.float32),
    blobs_out: Blobs,
    extent_out: wp.array(dtype=wp.vec3),
):
    """Centre, stretch and weight of each particle's kernel, and half the box that holds it."""
    i = first + wp.tid()
    x_i = x[i]
    rho = float(0.0)
    total = float(0.0)
    mean = wp.vec3()
    second = wp.mat33()
    neighbors = int(-1)  # without the particle itself
    j = int(0)
    candidates = wp.hash_grid_query(grid, x_i, REACH)
    while wp.hash_grid_query_next(candidates, j):
        d = x[j] - x_i
        r2 = wp.dot(d, d)
        if r2 < REACH * REACH:
            q = wp.sqrt(r2)
            rho += mass[j] * wendland(q)
            w = 1.0 - 0.125 * q * r2
            total += w
            mean += w * d
            second += wp.outer(w * d, d)
            neighbors += 1
    directions = wp.identity(3, dtype=float)
    lengths = wp.vec3(p.alone, p.alone, p.alone)
    center = x_i
    if neighbors >= p.fewest:
        mean = mean / total
        center = x_i + p.smoothing * mean
        directions, lengths = axes((second / total - wp.outer(mean, mean)) / FULL, p)
    turned = wp.transpose(directions)
    inverse = wp.vec3(1.0 / lengths[0], 1.0 / lengths[1], 1.0 / lengths[2])
    blobs_out.center[i] = center
    blobs_out.stretch[i] = directions * wp.diag(inverse) * turned
    blobs_out.weight[i] = mass[i] / rho * inverse[0] * inverse[1] * inverse[2]
    reach = directions * wp.diag(lengths) * turned
    extent_out[i] = REACH * wp.vec3(wp.length(reach[0]), wp.length(reach[1]), wp.length(reach[2]))


@wp.func
def field_reaches(grid: wp.uint64, r: wp.vec3, radius: float, blobs: Blobs, level: float) -> bool:
    """Whether the kernels in the cells within ``radius`` add up to the level."""
    phi = float(0.0)
    j = int(0)
    candidates = wp.hash_grid_query(grid, r, radius)
    while phi < level and wp.hash_grid_query_next(candidates, j):
        d = r - blobs.center[j]
        if wp.dot(d, d) < REACH * REACH:
            phi += blobs.weight[j] * wendland(wp.length(blobs.stretch[j] * d))
    return phi >= level


@wp.func
def field_and_gradient(grid: wp.uint64, r: wp.vec3, blobs: Blobs) -> wp.vec4:
    """grad phi and phi."""
    phi = float(0.0)
    gradient = wp.vec3()
    j = int(0)
    candidates = wp.hash_grid_query(grid, r, REACH)
    while wp.hash_grid_query_next(candidates, j):
        d = r - blobs.center[j]
        if wp.dot(d, d) < REACH * REACH:
            g = blobs.stretch[j]
            u = g * d
            q = wp.length(u)
            phi += blobs.weight[j] * wendland(q)
            gradient += blobs.weight[j] * wendland_slope(q) * (g * u)  # G is symmetric
    return wp.vec4(gradient[0], gradient[1], gradient[2], phi)


@register
def mark_inside(
    first: int,
    bricks: wp.array(dtype=wp.vec3i),
    grid: wp.uint64,
    blobs: Blobs,
    spacing: float,
    level: float,
    inside_out: wp.array(dtype=wp.uint8),
):
    """Which nodes are in the fluid."""
    n = first + wp.tid()
    r = node_position(bricks, n, spacing)
    inside = field_reaches(grid, r, CORE, blobs, level)
    if not inside:
        inside = field_reaches(grid, r, REACH, blobs, level)
    inside_out[n] = wp.where(inside, wp.uint8(1), wp.uint8(0))


@register
def place_vertices(
    first: int,
    bricks: wp.array(dtype=wp.vec3i),
    edges: wp.array(dtype=wp.vec2i),
    inside: wp.array(dtype=wp.uint8),
    grid: wp.uint64,
    blobs: Blobs,
    spacing: float,
    level: float,
    steps: int,
    x_out: wp.array(dtype=wp.vec3),
    normal_out: wp.array(dtype=wp.vec3),
):
    """Where the field passes the level along an edge, and the normal -grad phi / |grad phi|.

    The field rises from nothing within one spacing, so what a straight line between the nodes'
    values would give shows the grid. Newton's steps instead, or halving where one leaves the
    interval that is known to hold the root.
    """
    k = first + wp.tid()
    n = edges[k][0]
    axis = edges[k][1]
    start = node_position(bricks, n, spacing)
    along = wp.vec3()
    along[axis] = spacing
    outwards = wp.where(inside[n] != wp.uint8(0), 1.0, -1.0)
    normal = outwards * along
    near = 0.5 * NEARLY  # at the nodes themselves triangles would have no area
    far = 1.0 - 0.5 * NEARLY
    t = float(0.5)
    for _ in range(steps):
        f = field_and_gradient(grid, start + t * along, blobs)
        gradient = wp.vec3(f[0], f[1], f[2])
        if wp.length_sq(gradient) > 0.0:
            normal = -gradient
        rest = level - f[3]
        if (rest <= 0.0) == (outwards > 0.0):
            near = t
        else:
            far = t
        slope = gradient[axis] * spacing
        guess = t + rest / wp.where(slope != 0.0, slope, 1.0)
        # A root that is found is an end of the interval, and the next guess beside it on any side.
        trusted = slope != 0.0 and guess > near - NEARLY and guess < far + NEARLY
        t = wp.where(trusted, wp.clamp(guess, near, far), 0.5 * (near + far))
    x_out[k] = start + t * along
    normal_out[k] = wp.normalize(normal)
