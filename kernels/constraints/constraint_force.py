"""Constraints as penalty forces: every particle gathers over its own tuples: nothing collides."""

import functools
from typing import Any

import warp as wp

from ..engine.loops import Periodicity, box_type
from ..precision import Precision, register
from .constraints import bodies_type, tuples_type, view_function


@wp.struct
class Seats:
    """The tuples of every particle that is in one: row k is particle ``particle[k]``."""

    particle: wp.array(dtype=wp.int32)
    begin: wp.array(dtype=wp.int32)
    tuple: wp.array(dtype=wp.int32)
    seat: wp.array(dtype=wp.int32)  # which of the tuple's particles it is


@functools.cache
def force_kernels(
    evaluate: wp.Function, precision: Precision, periodic: Periodicity, compensated: bool,
    size: int, item: Any, relative: bool,
) -> tuple[wp.Kernel, wp.Kernel]:  # fmt: skip
    """Kernels: f_a -= grad_a C (C / alpha + beta dC/dt); energy C^2 / (2 alpha) and virial."""
    vec3, real, Box = precision.vec3, precision.scalar, box_type(precision)
    Bodies, Tuples = bodies_type(precision), tuples_type(precision, size, item)
    view = view_function(evaluate, precision, periodic, compensated, size, item, relative)

    @register
    def constraint_force(
        first: int,
        seats: Seats,
        box: wp.array(dtype=Box),
        t: Tuples,
        b: Bodies,
        f_io: wp.array(dtype=vec3),
    ):
        k = first + wp.tid()
        i = seats.particle[k]
        total = f_io[i]
        for n in range(seats.begin[k], seats.begin[k + 1]):
            r = seats.tuple[n]
            ids = t.particle[r]
            q = t.item[r]
            _x, _e, _X, C, G = view(r, box, t, b)
            rate = real(0.0)
            for a in range(wp.static(size)):
                rate += wp.dot(G[a], b.v[ids[a]])
            pull = C / q.compliance + q.damping * rate
            if t.one_sided != 0:  # never adhesive, whatever the damping
                pull = wp.where(C < real(0.0), wp.min(pull, real(0.0)), real(0.0))
            f = G[seats.seat[n]] * pull
            if wp.isfinite(wp.dot(f, f)):  # no gradient there, no force
                total = total - f
        f_io[i] = total

    @register
    def constraint_measure(
        first: int,
        seats: Seats,
        box: wp.array(dtype=Box),
        t: Tuples,
        b: Bodies,
        energy_io: wp.array(dtype=wp.float64),
        virial_io: wp.array(dtype=wp.float64),
    ):
        k = first + wp.tid()
        i = seats.particle[k]
        for n in range(seats.begin[k], seats.begin[k + 1]):
            r = seats.tuple[n]
            _x, _e, X, C, G = view(r, box, t, b)
            a = seats.seat[n]
            pull = C / t.item[r].compliance
            if t.one_sided != 0 and C >= real(0.0):
                pull = real(0.0)
            w = -pull * wp.dot(G[a], X[a] - X[0])
            if wp.isfinite(w):
                # Each of the tuple's particles gets its share.
                energy_io[i] = energy_io[i] + wp.float64(C * pull / real(wp.static(2.0 * size)))
                virial_io[i] = virial_io[i] + wp.float64(w)

    return constraint_force, constraint_measure
