"""What goes into a solve for pressures, and what comes of it."""

import functools

import warp as wp

from ....precision import Precision, register
from ..walls import normals_of


@functools.cache
def foresee_kernel(precision: Precision, places: int) -> wp.Kernel:
    """Kernel: u = v + (w f + b) dt of every slot, and how it parts from walls in these places."""
    real, vec3 = precision.scalar, precision.vec3
    total = max(places, 1)
    each, normals, walled = precision.vector(total), normals_of(precision, total), places > 0

    @register
    def foresee(
        first: int,
        order: wp.array(dtype=wp.int32),
        v: wp.array(dtype=vec3),
        f: wp.array(dtype=vec3),
        w: wp.array(dtype=real),
        b: wp.array(dtype=vec3),
        rate: wp.array(dtype=each),
        normal: wp.array(dtype=normals),
        dt: real,
        u_out: wp.array(dtype=vec3),
        parting_out: wp.array(dtype=each),
    ):
        i = first + wp.tid()
        particle = order[i]
        dv = (f[particle] * w[particle] + b[i]) * dt
        u_out[i] = v[i] + dv
        if wp.static(walled):
            R = each(rate[i])
            N = normal[i]
            for k in range(wp.static(total)):
                R[k] += wp.dot(vec3(N[k, 0], N[k, 1], N[k, 2]), dv)
            parting_out[i] = R

    return foresee


@functools.cache
def settle_kernel(precision: Precision) -> wp.Kernel:
    """Kernel: what a solve has found counts."""
    real, vec3 = precision.scalar, precision.vec3

    @register
    def settle(
        first: int,
        order: wp.array(dtype=wp.int32),
        k: wp.array(dtype=real),
        a: wp.array(dtype=vec3),
        found_out: wp.array(dtype=real),
        total_io: wp.array(dtype=real),
        b_io: wp.array(dtype=vec3),
    ):
        """What was found counts."""
        i = first + wp.tid()
        found_out[order[i]] = k[i]
        total_io[i] = total_io[i] + k[i]
        b_io[i] = b_io[i] + a[i]

    return settle


@functools.cache
def force_kernel(precision: Precision) -> wp.Kernel:
    """Kernel: particles get the force of all pressures, m b."""
    vec3, vec4 = precision.vec3, precision.vector(4)

    @register
    def give_force(
        first: int,
        order: wp.array(dtype=wp.int32),
        state: wp.array(dtype=vec4),
        b: wp.array(dtype=vec3),
        f_io: wp.array(dtype=vec3),
    ):
        i = first + wp.tid()
        f_io[order[i]] = f_io[order[i]] + b[i] * state[i][0]

    return give_force


@functools.cache
def pressure_kernel(precision: Precision) -> wp.Kernel:
    """Kernel: slots and particles get pressures."""
    real, vec4 = precision.scalar, precision.vector(4)

    @register
    def give_pressure(
        first: int,
        order: wp.array(dtype=wp.int32),
        k: wp.array(dtype=real),
        state_io: wp.array(dtype=vec4),
        pressure_out: wp.array(dtype=real),
    ):
        """Of every slot its k, and of its particle the pressure k rho^2."""
        i = first + wp.tid()
        state = state_io[i]
        state_io[i] = vec4(state[0], state[1], k[i], state[3])
        pressure_out[order[i]] = k[i] * state[1] * state[1]

    return give_pressure


@functools.cache
def recall_kernel(precision: Precision) -> wp.Kernel:
    """Kernel: k of the pressures that were found last."""
    real = precision.scalar

    @register
    def recall(
        first: int,
        order: wp.array(dtype=wp.int32),
        rho: wp.array(dtype=real),
        pressure: wp.array(dtype=real),
        k_out: wp.array(dtype=real),
    ):
        """k of the pressures that were found last."""
        i = first + wp.tid()
        particle = order[i]
        k = real(0.0)
        if rho[particle] > real(0.0):
            k = pressure[particle] / rho[particle] / rho[particle]
        k_out[i] = k

    return recall


@functools.cache
def note_kernel() -> wp.Kernel:
    """Kernel: what a substep has come to, by world, and the most that it has been off by."""

    @register
    def note(
        first: int,
        error: wp.array(dtype=wp.float64),
        iterations: wp.array(dtype=wp.int32),
        tolerance: wp.float64,
        error_out: wp.array(dtype=wp.float64),
        iterations_out: wp.array(dtype=wp.int32),
        missed_io: wp.array(dtype=wp.float64),
    ):
        w = first + wp.tid()
        error_out[w] = error[w]
        iterations_out[w] = iterations[w]
        if not error[w] <= tolerance:
            missed_io[w] = wp.max(missed_io[w], error[w])

    return note
