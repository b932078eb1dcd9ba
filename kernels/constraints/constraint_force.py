"""Constraints as penalty forces: every particle gathers over its own tuples: nothing collides."""

import functools

import warp as wp

from ..precision import function, register
from ..tensor import Tensor, virial_function, virial_type
from .constraints import Solved, view_function


@wp.struct
class Seats:
    """The tuples of every particle that is in one: row k is particle ``particle[k]``."""

    particle: wp.array(dtype=wp.int32)
    begin: wp.array(dtype=wp.int32)
    tuple: wp.array(dtype=wp.int32)
    seat: wp.array(dtype=wp.int32)  # which of the tuple's particles it is


@functools.cache
def force_kernel(law: Solved) -> wp.Kernel:
    """Kernel: f_a -= grad_a C (C / alpha + beta dC/dt)."""
    real, Box, Tuples, Bodies = law.types
    vec3, size, view = law.precision.vec3, law.size, view_function(law)
    damped, one_sided = law.damped, law.one_sided

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
            _X, C, G = view(r, box, t, b)
            pull = C / q.compliance
            if wp.static(damped):
                rate = real(0.0)
                for a in range(wp.static(size)):
                    rate += wp.dot(G[a], b.v[ids[a]])
                pull = pull + q.damping * rate
            if wp.static(one_sided):  # never adhesive, whatever the damping
                pull = wp.where(C < real(0.0), wp.min(pull, real(0.0)), real(0.0))
            f = G[seats.seat[n]] * pull
            if wp.isfinite(f[0] + f[1] + f[2]):  # no gradient there, no force
                total = total - f
        f_io[i] = total

    return constraint_force


@functools.cache
def measure_kernel(law: Solved, tensor: bool) -> wp.Kernel:
    """Kernel: energy C^2 / (2 alpha) and virial, to each of a tuple's particles its share.

    ``tensor``: the virial as a tensor.
    """
    real, Box, Tuples, Bodies = law.types
    size, view, one_sided = law.size, view_function(law), law.one_sided
    kind, virial = virial_type(tensor), virial_function(law.precision, tensor)

    @register
    def constraint_measure(
        first: int,
        seats: Seats,
        box: wp.array(dtype=Box),
        t: Tuples,
        b: Bodies,
        energy_io: wp.array(dtype=wp.float64),
        virial_io: wp.array(dtype=kind),
    ):
        k = first + wp.tid()
        i = seats.particle[k]
        for n in range(seats.begin[k], seats.begin[k + 1]):
            r = seats.tuple[n]
            X, C, G = view(r, box, t, b)
            a = seats.seat[n]
            pull = C / t.item[r].compliance
            if wp.static(one_sided):
                pull = wp.where(C >= real(0.0), real(0.0), pull)
            d = X[a] - X[0]
            if wp.isfinite(wp.float64(pull) * wp.float64(wp.dot(G[a], d))):
                share = wp.float64(wp.static(1.0 / (2.0 * size)))
                energy_io[i] = energy_io[i] + wp.float64(C) * wp.float64(pull) * share
                virial_io[i] = virial_io[i] - virial(G[a], d) * wp.float64(pull)

    return constraint_measure


def counted_function(law: Solved) -> wp.Function:
    """``counted(C, r, t)``: C of tuple r; of an inequality what is below 0, of a broken one 0."""
    real, _, Tuples, _ = law.types
    one_sided, breakable = law.one_sided, law.breakable

    def counted(C: real, r: int, t: Tuples):
        if wp.static(one_sided):
            C = wp.min(C, real(0.0))
        if wp.static(breakable):
            if t.broken[r] != 0:
                C = real(0.0)
        return C

    return function(counted)


@functools.cache
def virial_kernel(law: Solved) -> wp.Kernel:
    """Kernel: virial F sum_a grad_a C x_a^T of multipliers, F = lam / dt^2, and the energy of
    compliant tuples, to each particle its share.

    That is C^2 / (2 alpha), and alpha F^2 / 2 where a substep has not brought both together: what
    a stiff tuple is off by for want of iterations is no energy that it holds.
    """
    real, Box, Tuples, Bodies = law.types
    size, view, counted = law.size, view_function(law), counted_function(law)
    virial = virial_function(law.precision, tensor=True)

    @register
    def constraint_virial(
        first: int,
        seats: Seats,
        box: wp.array(dtype=Box),
        t: Tuples,
        b: Bodies,
        energy_io: wp.array(dtype=wp.float64),
        stress_io: wp.array(dtype=Tensor),
    ):
        k = first + wp.tid()
        i = seats.particle[k]
        for n in range(seats.begin[k], seats.begin[k + 1]):
            r = seats.tuple[n]
            a = seats.seat[n]
            X, C, G = view(r, box, t, b)
            C = counted(C, r, t)
            alpha = wp.float64(t.item[r].compliance)
            F = wp.float64(t.lam[r]) * t.scale[0] * wp.float64(b.unit)
            if alpha > wp.float64(0.0) and C != real(0.0):
                twice = wp.float64(C) * wp.float64(C) / alpha
                if F != wp.float64(0.0):
                    twice = wp.min(twice, alpha * F * F)
                energy_io[i] = energy_io[i] + twice * wp.float64(wp.static(0.5 / size))
            d = X[a] - X[0]
            if wp.isfinite(F * wp.float64(wp.dot(G[a], d))):
                stress_io[i] = stress_io[i] + virial(G[a], d) * F

    return constraint_virial
