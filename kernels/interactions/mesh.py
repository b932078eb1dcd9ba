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

from ..engine.atomics import add_function
from ..precision import Precision, function, register, structure

HIGHEST = 8  # order of the splines
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
            "order": wp.int32,  # of the splines
            "scale": wp.float64,  # of charges, to whole numbers
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
def _place_functions(precision: Precision) -> SimpleNamespace:
    """``place(x, g)`` is it in spacings from the first node, within the box; ``wrapped(k, n)``."""
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

    def wrapped(k: int, nodes: int):
        return wp.where(k < 0, k + nodes, wp.where(k >= nodes, k - nodes, k))

    return SimpleNamespace(place=function(place), wrapped=function(wrapped))


@functools.cache
def put_kernel(precision: Precision) -> wp.Kernel:
    """Kernel over particles: put their charges on the mesh.

    They are added up in whole numbers, whose sum is the same in any order.
    """
    vec3, real, Mesh = precision.vec3, precision.scalar, mesh_type()
    of, rise, add = _place_functions(precision), spline_functions().rise, add_function()
    place, wrapped = of.place, of.wrapped

    @register
    def put_charges(
        first: int, meshes: wp.array(dtype=Mesh), world: wp.array(dtype=wp.int32),
        x: wp.array(dtype=vec3), charge: wp.array(dtype=real), sums: wp.array(dtype=wp.int64),
    ):  # fmt: skip
        i = first + wp.tid()
        g = meshes[world[i]]
        s, inside = place(x[i], g)
        if inside != 0 and charge[i] != real(0.0):
            q = wp.float64(charge[i]) * g.scale
            k = wp.vec3i(int(wp.floor(s[0])), int(wp.floor(s[1])), int(wp.floor(s[2])))
            wx = rise(s[0] - wp.float64(k[0]), g.order)
            wy = rise(s[1] - wp.float64(k[1]), g.order)
            wz = rise(s[2] - wp.float64(k[2]), g.order)
            for a in range(g.order):
                plane = g.first + wrapped(k[0] - a, g.nodes[0]) * g.nodes[1] * g.nodes[2]
                for b in range(g.order):
                    row = plane + wrapped(k[1] - b, g.nodes[1]) * g.nodes[2]
                    share = q * wx[a] * wy[b]
                    for c in range(g.order):
                        whole = wp.int64(wp.rint(share * wz[c]))
                        add(row + wrapped(k[2] - c, g.nodes[2]), whole, sums)

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
                plane = g.first + wrapped(k[0] - a, g.nodes[0]) * g.nodes[1] * g.nodes[2]
                for b in range(p):
                    row = plane + wrapped(k[1] - b, g.nodes[1]) * g.nodes[2]
                    along, sloped = wp.float64(0.0), wp.float64(0.0)
                    for c in range(p):
                        u = potential[row + wrapped(k[2] - c, g.nodes[2])]
                        along += u * wz[c]
                        sloped += u * dz[c]
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
