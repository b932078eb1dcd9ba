"""Fields of a fluid: derivatives at its particles, and sums at any points.

At a particle derivatives are sums over its neighbours of what the field differs by there:

    grad A_i = sum_j V_j (A_j - A_i) grad_i W_ij                    (then K_i^-1 times it)
    lap A_i  = 2 sum_j V_j (A_i - A_j - grad A_i . x_ij) W'_ij / r  (with K alone; d / N_i times it)

    K_i = sum_j V_j (x_j - x_i) grad_i W_ij     N_i = -sum_j V_j r W'_ij     V_j = m_j / rho_j
"""

import functools
from typing import Any

import warp as wp

from ...engine.loops import Periodicity, Term, box_type, minimum_image, reader
from ...engine.neighbors.renewal import cells_type
from ...precision import Precision, function, register

SINGULAR = 1e-3  # of the largest eigenvalue: nobody is near along such a direction


def gradient_term(slope: wp.Function, precision: Precision, data: Any, params: Any) -> Term:
    """Term V_j (A_j - A_i) grad W, row by row, and the six numbers of K."""
    real, vec3, many = precision.scalar, precision.vec3, precision.vector(15)
    state_of, value_of = reader(precision, 4), reader(precision, 3)

    def add_gradient(i: int, j: int, x_ij: vec3, r2: real, d: data, p: params):
        state_j = state_of(d.state, j)
        a = value_of(d.a, j) - value_of(d.a, i)
        share = state_j[0] / state_j[1] * p.sigma * p.inverse_h * p.inverse_h
        g = share * slope(wp.sqrt(r2) * p.inverse_h) * x_ij
        return many(
            a[0] * g[0], a[0] * g[1], a[0] * g[2],
            a[1] * g[0], a[1] * g[1], a[1] * g[2],
            a[2] * g[0], a[2] * g[1], a[2] * g[2],
            -x_ij[0] * g[0], -x_ij[1] * g[1], -x_ij[2] * g[2],
            -x_ij[0] * g[1], -x_ij[0] * g[2], -x_ij[1] * g[2],
        )  # fmt: skip

    return Term(function(add_gradient), 15)


@functools.cache
def keep_gradient(
    normalized: bool, precision: Precision, data: Any, params: Any, out: Any
) -> wp.Function:
    """Store: the gradient, rows in a row; ``normalized`` by the inverse of K where it has one."""
    real, mat33, vec3 = precision.scalar, precision.mat33, precision.vec3
    many, nine = precision.vector(15), precision.vector(9)

    def keep(i: int, particle: int, total: many, d: data, p: params, o: out):
        g = mat33(
            total[0], total[1], total[2], total[3], total[4], total[5], total[6], total[7], total[8]
        )
        if wp.static(normalized):
            k = mat33(
                total[9], total[12], total[13],
                total[12], total[10], total[14],
                total[13], total[14], total[11],
            )  # fmt: skip
            axes, size = wp.eig3(k)
            least = real(SINGULAR) * wp.max(wp.max(size[0], size[1]), size[2])
            inverse = vec3()
            for axis in range(3):
                inverse[axis] = wp.where(size[axis] > least, real(1.0) / size[axis], real(0.0))
            g = g * (axes * wp.diag(inverse) * wp.transpose(axes))
        o.gradient[i] = nine(
            g[0, 0], g[0, 1], g[0, 2], g[1, 0], g[1, 1], g[1, 2], g[2, 0], g[2, 1], g[2, 2]
        )

    return function(keep)


def laplacian_term(
    slope: wp.Function, normalized: bool, precision: Precision, data: Any, params: Any
) -> Term:
    """Term 2 V_j (A_i - A_j - grad A_i . x_ij) W' / r, and the one of N."""
    real, vec3, four = precision.scalar, precision.vec3, precision.vector(4)
    state_of, value_of = reader(precision, 4), reader(precision, 3)

    def add_laplacian(i: int, j: int, x_ij: vec3, r2: real, d: data, p: params):
        state_j = state_of(d.state, j)
        a = value_of(d.a, i) - value_of(d.a, j)
        if wp.static(normalized):
            g = d.gradient[i]
            a -= vec3(
                g[0] * x_ij[0] + g[1] * x_ij[1] + g[2] * x_ij[2],
                g[3] * x_ij[0] + g[4] * x_ij[1] + g[5] * x_ij[2],
                g[6] * x_ij[0] + g[7] * x_ij[1] + g[8] * x_ij[2],
            )
        share = state_j[0] / state_j[1] * p.sigma * p.inverse_h * p.inverse_h
        s = share * slope(wp.sqrt(r2) * p.inverse_h)
        return four(real(2.0) * s * a[0], real(2.0) * s * a[1], real(2.0) * s * a[2], -s * r2)

    return Term(function(add_laplacian), 4)


@functools.cache
def keep_laplacian(
    normalized: bool, dimension: int, precision: Precision, data: Any, params: Any, out: Any
) -> wp.Function:
    """Store: the laplacian; ``normalized`` times d / N."""
    real, vec3, four = precision.scalar, precision.vec3, precision.vector(4)

    def keep(i: int, particle: int, total: four, d: data, p: params, o: out):
        scale = real(1.0)
        if wp.static(normalized):
            scale = wp.where(total[3] > real(0.0), real(float(dimension)) / total[3], real(0.0))
        o.laplacian[i] = scale * vec3(total[0], total[1], total[2])

    return function(keep)


@functools.cache
def combination_kernel(precision: Precision, width: int, given: int) -> wp.Kernel:
    """Kernel: ``width`` numbers as combinations of the ``given`` ones of a row."""
    result, source = precision.vector(width), precision.vector(given)
    matrix = wp.types.matrix(shape=(width, given), dtype=precision.scalar)

    @register
    def combine(
        first: int,
        of: matrix,
        row: wp.array(dtype=wp.int32),
        values: wp.array(dtype=source),
        out: wp.array(dtype=result),
    ):
        k = first + wp.tid()
        out[k] = of * values[row[k]]

    return combine


@functools.cache
def seeking_kernel(precision: Precision, periodic: Periodicity) -> wp.Kernel:
    """Kernel: points in the periodic box, and where they look into a grid's cells.

    Points out of reach of all particles, which are within the corners, look into the outermost
    cells, so that cell numbers stay small.
    """
    vec3, Box, Cells = precision.vec3, box_type(precision), cells_type(precision)
    on = tuple(int(axis) for axis in periodic)

    @register
    def seek(
        first: int,
        world: int,
        cells: Cells,
        lower: vec3,
        upper: vec3,
        box: wp.array(dtype=Box),
        points_io: wp.array(dtype=vec3),
        u_out: wp.array(dtype=vec3),
    ):
        k = first + wp.tid()
        b = box[world]
        x = points_io[k]
        for axis in range(3):
            if wp.static(any(on)):
                x[axis] = x[axis] - b.length[axis] * wp.floor(
                    (x[axis] - b.lower[axis]) * b.inverse[axis]
                )
        points_io[k] = x
        near = wp.min(wp.max(x, lower), upper)
        u_out[k] = cells.turn * (near - cells.origin)

    return seek


@functools.cache
def interpolation_kernel(
    weight: wp.Function, width: int, precision: Precision, periodic: Periodicity, params: Any,
    own: bool,
) -> wp.Kernel:  # fmt: skip
    """Kernel: sum_j V_j A_j W(r - r_j, h) at each point r; normalized by the sum without A_j.

    ``own``: ``sizes`` are (1/h_j, sigma/h_j^d), of lengths of the particles' own.
    """
    real, vec3, vec4, Box = (
        precision.scalar, precision.vec3, precision.vector(4), box_type(precision),
    )  # fmt: skip
    values = precision.vector(width)
    image, vec2 = minimum_image(precision, periodic), precision.vector(2)

    @register
    def interpolate(
        first: int,
        grid: wp.uint64,
        world: int,
        normalized: bool,
        box: wp.array(dtype=Box),
        parameters: wp.array(dtype=params),
        x: wp.array(dtype=vec3),
        state: wp.array(dtype=vec4),
        samples: wp.array(dtype=values),
        sizes: wp.array(dtype=vec2),
        points: wp.array(dtype=vec3),
        u: wp.array(dtype=vec3),
        out: wp.array(dtype=values),
    ):
        k = first + wp.tid()
        p = parameters[world]
        total = values()
        whole = real(0.0)
        j = int(0)
        candidates = wp.hash_grid_query(grid, u[k], real(1.0))
        while wp.hash_grid_query_next(candidates, j):
            x_ij = image(points[k] - x[j], box[world])
            r2 = wp.dot(x_ij, x_ij)
            if r2 < p.cutoff_squared:
                w = state[j][0] / state[j][1]
                if wp.static(own):
                    w *= sizes[j][1] * weight(wp.sqrt(r2) * sizes[j][0])
                else:
                    w *= p.sigma * weight(wp.sqrt(r2) * p.inverse_h)
                total += w * samples[j]
                whole += w
        if normalized and whole > real(0.0):
            total = total / whole
        out[k] = total

    return interpolate
