"""Sums over particles, in float64 and in an order of their own."""

import functools

import warp as wp

from ..engine.integrate import widened
from ..precision import FLOAT64, Precision, register
from ..tensor import AXES, Tensor, virial_function

# Mass, momentum (3), angular momentum (3), kinetic, potential, virial, whether it has parts that
# are not in the tensor; m v v^T + r F^T (6).
QUANTITIES = 11 + len(AXES)


@functools.cache
def block_sums_kernel(precision: Precision) -> wp.Kernel:
    """Kernel: one thread sums one block of particles, one after the other, in float64."""
    vec3, real, wide = precision.vec3, precision.scalar, widened(precision)
    outer = virial_function(FLOAT64, tensor=True)

    @register
    def block_sums(
        first: int,
        begin: wp.array(dtype=wp.int32),
        end: wp.array(dtype=wp.int32),
        x: wp.array(dtype=vec3),
        v: wp.array(dtype=vec3),
        m: wp.array(dtype=real),
        w: wp.array(dtype=real),
        energy: wp.array(dtype=wp.float64),
        virial: wp.array(dtype=wp.float64),
        stress: wp.array(dtype=Tensor),
        sums_out: wp.array2d(dtype=wp.float64),
    ):
        b = first + wp.tid()
        mass = wp.float64(0.0)
        p = wp.vec3d()
        angular = wp.vec3d()
        kinetic = wp.float64(0.0)
        potential = wp.float64(0.0)
        total_virial = wp.float64(0.0)
        partly = wp.float64(0.0)
        flow = Tensor()
        for i in range(begin[b], end[b]):
            m_i = wp.float64(m[i])
            mass += m_i
            if w[i] > real(0.0):  # a pinned particle's momentum is not the scene's
                v_i = wide(v[i])
                p += m_i * v_i
                angular += m_i * wp.cross(wide(x[i]), v_i)
                kinetic += wp.float64(0.5) * m_i * wp.dot(v_i, v_i)
                flow += outer(m_i * v_i, v_i)
            potential += energy[i]
            r = stress[i]
            flow += r
            total_virial += virial[i] + r[0] + r[1] + r[2]
            if virial[i] != wp.float64(0.0):
                partly = wp.float64(1.0)
        sums_out[b, 0] = mass
        for a in range(3):
            sums_out[b, 1 + a] = p[a]
            sums_out[b, 4 + a] = angular[a]
        sums_out[b, 7] = kinetic
        sums_out[b, 8] = potential
        sums_out[b, 9] = total_virial
        sums_out[b, 10] = partly
        for a in range(wp.static(len(AXES))):
            sums_out[b, 11 + a] = flow[a]

    return block_sums
