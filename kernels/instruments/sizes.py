"""The largest of what limits the step: speeds, accelerations, densities."""

import functools

import warp as wp

from ..engine.integrate import widened
from ..precision import Precision, register


@functools.cache
def sizes_kernel(precision: Precision) -> wp.Kernel:
    """Kernel: |v|^2, |w f|^2 and rho, the largest of each block; infinite where one is no number.

    Forces and densities that a scene does not have are of length 0. One thread looks at one block.
    """
    vec3, real, wide = precision.vec3, precision.scalar, widened(precision)

    @register
    def largest_sizes(
        first: int,
        begin: wp.array(dtype=wp.int32),
        end: wp.array(dtype=wp.int32),
        v: wp.array(dtype=vec3),
        f: wp.array(dtype=vec3),
        w: wp.array(dtype=real),
        rho: wp.array(dtype=real),
        sizes_out: wp.array(dtype=wp.vec3d),
    ):
        b = first + wp.tid()
        largest = wp.vec3d()
        for i in range(begin[b], end[b]):
            size = wp.vec3d()
            if w[i] > real(0.0):  # pinned ones go their way at any step
                size[0] = wp.length_sq(wide(v[i]))
                if f.shape[0] > 0:
                    size[1] = wp.length_sq(wide(f[i]) * wp.float64(w[i]))
            if rho.shape[0] > 0:
                size[2] = wp.float64(rho[i])
            for k in range(3):
                if wp.isfinite(size[k]):
                    largest[k] = wp.max(largest[k], size[k])
                else:
                    largest[k] = wp.float64(wp.inf)
        sizes_out[b] = largest

    return largest_sizes
