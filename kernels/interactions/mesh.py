"""Charges on a mesh by cardinal B-splines, and what they feel of its potential.

A charge at s spacings from the first node has the share M_p(s - k) of node k along each axis, p
nodes of them (Essmann et al. 1995, eq. 3.4). Its force is the slope of the same splines, so that it
is minus the derivative of the energy.
"""

import functools
import math
from types import SimpleNamespace
from typing import Any

import warp as wp

from ..precision import Precision, function, register, structure

HIGHEST = 8  # order of the splines
# Nodes of a column that come once more before its first, so that those that a charge reaches are
# next to each other, and always as many.
BEFORE = HIGHEST - 1
Weights = wp.types.vector(length=HIGHEST, dtype=wp.float64)


def mesh_type() -> Any:
    """The mesh of one world, its places in double precision whatever that of the particles."""
    return structure(
        "Mesh",
        {
            "lower": wp.vec3d,  # the first node
            "inverse": wp.vec3d,  # of the spacing
            "nodes": wp.vec3i,
            "first": wp.int32,  # row of the first node
            "column": wp.int32,  # number of the first column of nodes along z
            "order": wp.int32,  # of the splines
        },
    )


@functools.cache
def spline_functions() -> SimpleNamespace:
    """``rise(f, p)``: M_p(f + j) for j = 0 ... p - 1; ``slope(lower, p)``: their derivatives.

    By the recursion of Essmann et al. (1995, eq. 4.1 and 4.2), which adds up what is positive.
    """

    def rise(f: wp.float64, order: int):
        w = Weights()
        w[0] = f
        w[1] = wp.float64(1.0) - f
        for n in range(3, order + 1):
            part = wp.float64(1.0) / wp.float64(n - 1)
            for m in range(n):
                j = n - 1 - m
                u = f + wp.float64(j)
                before = wp.float64(0.0)
                if j > 0:
                    before = w[j - 1]
                w[j] = part * (u * w[j] + (wp.float64(n) - u) * before)
        return w

    def slope(lower: Weights, order: int):
        """Of the weights of the order below."""
        d = Weights()
        d[0] = lower[0]
        for j in range(1, order):
            d[j] = lower[j] - lower[j - 1]
        return d

    return SimpleNamespace(rise=function(rise), slope=function(slope))


@functools.cache
def wrap_function() -> wp.Function:
    """``wrapped(k, n)``: the node that one within a mesh beyond the first or the last is."""

    def wrapped(k: int, nodes: int):
        return wp.where(k < 0, k + nodes, wp.where(k >= nodes, k - nodes, k))

    return function(wrapped)


@functools.cache
def _place_functions(precision: Precision) -> SimpleNamespace:
    """``place(x, g)`` is it in spacings from the first node, within the box; and ``wrapped``."""
    vec3, Mesh = precision.vec3, mesh_type()

    def place(x: vec3, g: Mesh):
        s = wp.vec3d()
        inside = int(1)
        for a in range(3):
            n = wp.float64(g.nodes[a])
            s[a] = (wp.float64(x[a]) - g.lower[a]) * g.inverse[a]
            s[a] = s[a] - n * wp.floor(s[a] / n)
            if not (s[a] >= wp.float64(0.0) and s[a] <= n):  # what is no number is nowhere
                inside = 0
        return s, inside

    return SimpleNamespace(place=function(place), wrapped=wrap_function())


@functools.cache
def column_kernels(precision: Precision) -> SimpleNamespace:
    """Kernels that find which charges reach which columns of nodes along z, and with what shares.

    ``key``, over particles: the column that each stands in. ``begin``, over columns and one more:
    the first slot of each, once particles are in the order of their keys. ``weigh``, over slots:
    the shares of p nodes along each axis, the charge among those of x and along z from the first
    node on, with zeros before it; and the last node along z.
    """
    vec3, real, Mesh = precision.vec3, precision.scalar, mesh_type()
    of, rise = _place_functions(precision), spline_functions().rise
    place, wrapped = of.place, of.wrapped

    @register
    def find_columns(
        first: int, meshes: wp.array(dtype=Mesh), world: wp.array(dtype=wp.int32),
        x: wp.array(dtype=vec3), charge: wp.array(dtype=real), outside: int,
        key_out: wp.array(dtype=wp.int32), particle_out: wp.array(dtype=wp.int32),
    ):  # fmt: skip
        i = first + wp.tid()
        g = meshes[world[i]]
        s, inside = place(x[i], g)
        key_out[i] = outside
        particle_out[i] = i
        if inside != 0 and charge[i] != real(0.0):
            along = wrapped(int(wp.floor(s[0])), g.nodes[0]) * g.nodes[1]
            key_out[i] = g.column + along + wrapped(int(wp.floor(s[1])), g.nodes[1])

    @register
    def begin_columns(
        first: int, count: int, key: wp.array(dtype=wp.int32), begin_out: wp.array(dtype=wp.int32)
    ):
        k = first + wp.tid()
        low, high = int(0), int(count)
        while low < high:
            middle = (low + high) / 2
            if key[middle] < k:
                low = middle + 1
            else:
                high = middle
        begin_out[k] = low

    @register
    def weigh_charges(
        first: int, meshes: wp.array(dtype=Mesh), world: wp.array(dtype=wp.int32),
        particle: wp.array(dtype=wp.int32), x: wp.array(dtype=vec3), charge: wp.array(dtype=real),
        share_out: wp.array2d(dtype=wp.float64), last_out: wp.array(dtype=wp.int32),
    ):  # fmt: skip
        t = first + wp.tid()
        i = particle[t]
        g = meshes[world[i]]
        s, inside = place(x[i], g)
        if inside != 0:
            for a in range(3):
                w = rise(s[a] - wp.floor(s[a]), g.order)
                q = wp.where(a == 0, wp.float64(charge[i]), wp.float64(1.0))
                for j in range(HIGHEST):
                    share_out[t, wp.where(a == 2, 3 * HIGHEST - 1 - j, a * HIGHEST + j)] = q * w[j]
            last_out[t] = wrapped(int(wp.floor(s[2])), g.nodes[2])

    return SimpleNamespace(key=find_columns, begin=begin_columns, weigh=weigh_charges)


@functools.cache
def put_kernel() -> wp.Kernel:
    """Kernel over columns: what is put on each, added up in the order of the particles.

    Nobody else writes there, so that sums are the same on any threads.
    """
    Mesh, wrapped = mesh_type(), wrap_function()

    @register
    def put_charges(
        first: int, meshes: wp.array(dtype=Mesh), world: wp.array(dtype=wp.int32),
        begin: wp.array(dtype=wp.int32), share: wp.array2d(dtype=wp.float64),
        last: wp.array(dtype=wp.int32), sum_out: wp.array(dtype=wp.float64),
    ):  # fmt: skip
        k = first + wp.tid()
        g = meshes[world[k]]
        at = k - g.column
        row = g.first + at * (g.nodes[2] + BEFORE)
        for n in range(g.nodes[2] + BEFORE):
            sum_out[row + n] = wp.float64(0.0)
        for a in range(g.order):
            along = wrapped(at / g.nodes[1] + a, g.nodes[0]) * g.nodes[1]
            for b in range(g.order):
                column = g.column + along + wrapped(at % g.nodes[1] + b, g.nodes[1])
                for t in range(begin[column], begin[column + 1]):
                    q = share[t, a] * share[t, HIGHEST + b]
                    n = row + last[t]
                    for c in range(HIGHEST):
                        sum_out[n + c] = sum_out[n + c] + q * share[t, 2 * HIGHEST + c]
        for c in range(BEFORE):
            n = row + c
            sum_out[n + g.nodes[2]] = sum_out[n + g.nodes[2]] + sum_out[n]

    return put_charges


@functools.cache
def feel_kernel(precision: Precision) -> wp.Kernel:
    """Kernel over particles: feel the potential of the mesh."""
    vec3, real, Mesh = precision.vec3, precision.scalar, mesh_type()
    of, splines = _place_functions(precision), spline_functions()
    place, wrapped, rise, slope = of.place, of.wrapped, splines.rise, splines.slope

    @register
    def feel_mesh(
        first: int, meshes: wp.array(dtype=Mesh), world: wp.array(dtype=wp.int32),
        x: wp.array(dtype=vec3), charge: wp.array(dtype=real),
        potential: wp.array(dtype=wp.float64), alone: wp.array(dtype=wp.vec3d),
        energy_out: wp.array(dtype=wp.float64), field_out: wp.array(dtype=vec3),
    ):  # fmt: skip
        """Of each charge its half of its energies with all, and its force.

        Without what it has with itself by where it is between the nodes, C cos(2 pi s) by axis.
        """
        i = first + wp.tid()
        g = meshes[world[i]]
        s, inside = place(x[i], g)
        total = wp.vec4d()
        if inside != 0 and charge[i] != real(0.0):
            p = g.order
            k = wp.vec3i(int(wp.floor(s[0])), int(wp.floor(s[1])), int(wp.floor(s[2])))
            fx, fy, fz = s[0] - wp.float64(k[0]), s[1] - wp.float64(k[1]), s[2] - wp.float64(k[2])
            wx, wy, wz = rise(fx, p), rise(fy, p), rise(fz, p)
            dx = slope(rise(fx, p - 1), p)
            dy = slope(rise(fy, p - 1), p)
            dz = slope(rise(fz, p - 1), p)
            for a in range(p):
                plane = wrapped(k[0] - a, g.nodes[0]) * g.nodes[1]
                for b in range(p):
                    column = plane + wrapped(k[1] - b, g.nodes[1])
                    n = g.first + column * (g.nodes[2] + BEFORE) + wrapped(k[2], g.nodes[2])
                    along, sloped = wp.float64(0.0), wp.float64(0.0)
                    for c in range(HIGHEST):
                        u = potential[n + c]
                        along += u * wz[HIGHEST - 1 - c]
                        sloped += u * dz[HIGHEST - 1 - c]
                    total += wp.vec4d(
                        dx[a] * wy[b] * along, wx[a] * dy[b] * along, wx[a] * wy[b] * sloped,
                        wx[a] * wy[b] * along,
                    )  # fmt: skip
        q = wp.float64(charge[i])
        energy = wp.float64(0.5) * q * total[3]
        f = wp.vec3d()
        for a in range(3):
            turn = wp.float64(2.0 * math.pi) * s[a]
            C = q * q * alone[world[i]][a]
            energy -= C * wp.cos(turn)
            f[a] = g.inverse[a] * (-q * total[a] - C * wp.float64(2.0 * math.pi) * wp.sin(turn))
        energy_out[i] = energy
        field_out[i] = vec3(f)

    return feel_mesh
