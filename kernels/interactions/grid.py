"""Fields on regular grids: what particles put on them, how waves go, what particles feel.

Values between the nodes are those of the eight around, weighted linearly along each axis (cloud in
cell: Birdsall and Fuss 1969). Putting on the grid and reading from it by the same weights keeps
the momentum that they exchange, and a force that is the slope of what is read keeps the energy.
"""

import functools
from types import SimpleNamespace
from typing import Any

import warp as wp

from ..engine.atomics import add_function
from ..precision import Precision, function, register, structure


def grid_type(precision: Precision) -> Any:
    """The grid of one world."""
    return structure(
        f"Grid_{precision.name}",
        {
            "lower": precision.vec3,  # the first node
            "inverse": precision.vec3,  # of the spacing; 0 along an axis that nothing differs on
            "nodes": wp.vec3i,
            "wraps": wp.vec3i,  # whether the axis is periodic
            "first": wp.int32,  # row of the first node
            "scale": wp.float64,  # of what is put on it, to whole numbers
            "amount": precision.scalar,  # how strongly particles couple
            "speed_squared": precision.scalar,
            "damping": precision.scalar,  # rate
            "mass": precision.scalar,  # of the field, of one node
            "held": wp.int32,  # whether it is 0 on its edges
        },
    )


@functools.cache
def _shared(precision: Precision) -> wp.Function:
    """``part(s, upper, single)``: what a node of one axis has; where it is single all."""
    real = precision.scalar

    def part_of(s: real, upper: int, single: int):
        f = s - wp.floor(s)
        if single != 0:
            f = real(0.0)
        return wp.where(upper != 0, f, real(1.0) - f)

    return function(part_of)


@functools.cache
def weight_functions(precision: Precision) -> SimpleNamespace:
    """Functions of a place and a grid.

    ``place(x, g) -> (s, inside)`` is it in spacings from the first node. ``node(s, corner, g)`` is
    the row of one of the eight nodes around, ``weight`` its share and ``slope`` its derivative by
    the place.
    """
    vec3, real, Grid = precision.vec3, precision.scalar, grid_type(precision)

    def place(x: vec3, g: Grid):
        s = vec3()
        inside = int(1)
        for a in range(3):
            s[a] = (x[a] - g.lower[a]) * g.inverse[a]
            last = real(g.nodes[a] - 1)
            if g.wraps[a] == 0 and g.nodes[a] > 1:
                # What is no number is nowhere.
                if not (s[a] >= real(0.0) and s[a] <= last):
                    inside = 0
            if not wp.isfinite(s[a]):
                inside = 0
        return s, inside

    def row(s: vec3, corner: int, g: Grid):
        n = wp.vec3i(0, 0, 0)
        for a in range(3):
            k = int(wp.floor(s[a])) + ((corner >> a) & 1)
            if g.wraps[a] != 0:
                k = k % g.nodes[a]
                if k < 0:
                    k += g.nodes[a]
            n[a] = wp.min(k, g.nodes[a] - 1)
        return g.first + (n[0] * g.nodes[1] + n[1]) * g.nodes[2] + n[2]

    part = _shared(precision)

    def weight(s: vec3, corner: int, g: Grid):
        result = real(1.0)
        for a in range(3):
            result = result * part(s[a], (corner >> a) & 1, int(g.nodes[a] == 1))
        return result

    def slope(s: vec3, corner: int, g: Grid):
        result = vec3()
        for a in range(3):
            along = wp.where(((corner >> a) & 1) != 0, g.inverse[a], -g.inverse[a])
            for b in range(3):
                if b != a:
                    along = along * part(s[b], (corner >> b) & 1, int(g.nodes[b] == 1))
            result[a] = along
        return result

    return SimpleNamespace(
        place=function(place), row=function(row), weight=function(weight), slope=function(slope)
    )


@functools.cache
def coupling_kernels(precision: Precision) -> SimpleNamespace:
    """Kernels over particles: put their amounts on the grid; feel the field; the energy of both."""
    vec3, real, Grid = precision.vec3, precision.scalar, grid_type(precision)
    of, add = weight_functions(precision), add_function()
    place, row, weight, slope = of.place, of.row, of.weight, of.slope

    @register
    def put(
        first: int, particle: wp.array(dtype=wp.int32), world: wp.array(dtype=wp.int32),
        grids: wp.array(dtype=Grid), x: wp.array(dtype=vec3), amount: wp.array(dtype=real),
        sums: wp.array(dtype=wp.int64),
    ):  # fmt: skip
        k = first + wp.tid()
        i = particle[k]
        g = grids[world[k]]
        s, inside = place(x[i], g)
        if inside != 0:
            q = wp.float64(amount[i]) * wp.float64(g.amount) * g.scale
            for corner in range(8):
                share = wp.int64(wp.rint(q * wp.float64(weight(s, corner, g))))
                if share != wp.int64(0):
                    add(row(s, corner, g), share, sums)

    @register
    def feel(
        first: int, particle: wp.array(dtype=wp.int32), world: wp.array(dtype=wp.int32),
        grids: wp.array(dtype=Grid), x: wp.array(dtype=vec3), amount: wp.array(dtype=real),
        u: wp.array(dtype=real), f_io: wp.array(dtype=vec3),
    ):  # fmt: skip
        k = first + wp.tid()
        i = particle[k]
        g = grids[world[k]]
        s, inside = place(x[i], g)
        if inside != 0:
            total = vec3()
            for corner in range(8):
                total = total + slope(s, corner, g) * u[row(s, corner, g)]
            f_io[i] = f_io[i] - total * (amount[i] * g.amount)

    @register
    def share_energy(
        first: int, particle: wp.array(dtype=wp.int32), world: wp.array(dtype=wp.int32),
        grids: wp.array(dtype=Grid), x: wp.array(dtype=vec3), amount: wp.array(dtype=real),
        u: wp.array(dtype=real), own: wp.array(dtype=wp.float64), part: wp.float64,
        energy_io: wp.array(dtype=wp.float64),
    ):  # fmt: skip
        """``own`` is what the field of a world has by itself, to each particle its share."""
        k = first + wp.tid()
        i = particle[k]
        g = grids[world[k]]
        s, inside = place(x[i], g)
        value = wp.float64(0.0)
        if inside != 0:
            for corner in range(8):
                value += wp.float64(weight(s, corner, g)) * wp.float64(u[row(s, corner, g)])
        q = wp.float64(amount[i]) * wp.float64(g.amount)
        energy_io[i] = energy_io[i] + part * q * value + own[world[k]]

    return SimpleNamespace(put=put, feel=feel, energy=share_energy)


@functools.cache
def node_functions(precision: Precision) -> SimpleNamespace:
    """Functions of a row of a grid: its node, the row next to it along an axis, if on an edge."""
    Grid = grid_type(precision)

    def at(k: int, g: Grid):
        """Node of a row."""
        n = k - g.first
        of_row = n / g.nodes[2]
        return wp.vec3i(of_row / g.nodes[1], of_row % g.nodes[1], n % g.nodes[2])

    def beside(k: int, n: wp.vec3i, a: int, up: int, g: Grid):
        """The row of the next node along an axis; beyond an edge the node itself."""
        stride = int(1)
        if a == 0:
            stride = g.nodes[1] * g.nodes[2]
        if a == 1:
            stride = g.nodes[2]
        m = n[a] + up
        if m < 0 or m >= g.nodes[a]:
            m = wp.where(g.wraps[a] != 0, m - up * g.nodes[a], n[a])
        return k + (m - n[a]) * stride

    def edge(n: wp.vec3i, g: Grid):
        on = int(0)
        for a in range(3):
            if g.wraps[a] == 0 and g.nodes[a] > 1 and (n[a] == 0 or n[a] == g.nodes[a] - 1):
                on = 1
        return on

    return SimpleNamespace(at=function(at), beside=function(beside), edge=function(edge))


@functools.cache
def wave_kernels(precision: Precision) -> SimpleNamespace:
    """Kernels over nodes: the rate of a damped wave, its value, and by world its energy."""
    real, Grid = precision.scalar, grid_type(precision)

    of = node_functions(precision)
    node, next_to, on_edge = of.at, of.beside, of.edge

    @register
    def hasten(
        first: int, world: wp.array(dtype=wp.int32), grids: wp.array(dtype=Grid),
        sums: wp.array(dtype=wp.int64), u: wp.array(dtype=real), dt: real,
        rate_io: wp.array(dtype=real),
    ):  # fmt: skip
        """The rate at the end of a step, what damps it taken there."""
        k = first + wp.tid()
        g = grids[world[k]]
        n = node(k, g)
        pull = real(0.0)
        for a in range(3):
            if g.nodes[a] > 1:
                links = u[next_to(k, n, a, 1, g)] + u[next_to(k, n, a, -1, g)] - real(2.0) * u[k]
                pull = pull + links * g.inverse[a] * g.inverse[a]
        put = real(wp.float64(sums[k]) / g.scale)
        rate = rate_io[k] + dt * (g.speed_squared * pull - put / g.mass)
        rate = rate / (real(1.0) + g.damping * dt)
        rate_io[k] = wp.where(g.held != 0 and on_edge(n, g) != 0, real(0.0), rate)

    @register
    def go_on(first: int, dt: real, rate: wp.array(dtype=real), u_io: wp.array(dtype=real)):
        k = first + wp.tid()
        u_io[k] = u_io[k] + dt * rate[k]

    @register
    def own_energy(
        first: int, grids: wp.array(dtype=Grid), u: wp.array(dtype=real),
        rate: wp.array(dtype=real), share: wp.array(dtype=wp.float64),
        own_out: wp.array(dtype=wp.float64),
    ):  # fmt: skip
        """Half m of the squares of rates and of c times the slopes, by world, shared out."""
        w = first + wp.tid()
        g = grids[w]
        total = wp.float64(0.0)
        for m in range(g.nodes[0] * g.nodes[1] * g.nodes[2]):
            k = g.first + m
            n = node(k, g)
            each = rate[k] * rate[k]
            for a in range(3):
                if g.nodes[a] > 1:
                    d = (u[next_to(k, n, a, 1, g)] - u[k]) * g.inverse[a]
                    each = each + g.speed_squared * d * d
            total += wp.float64(each)
        own_out[w] = wp.float64(0.5) * wp.float64(g.mass) * total * share[w]

    return SimpleNamespace(hasten=hasten, go_on=go_on, energy=own_energy)
