"""The voxels of a volume."""

import functools

import warp as wp

from ...precision import register


@functools.cache
def lookup_kernel() -> wp.Kernel:
    """Kernel: the values of a box of voxels from ``first`` on."""

    @functools.partial(register, cpu_only=True)
    def look_up_voxels(volume: wp.uint64, first: wp.vec3i, out: wp.array3d(dtype=float)):
        i, j, k = wp.tid()
        out[i, j, k] = wp.volume_lookup_f(volume, first[0] + i, first[1] + j, first[2] + k)

    return look_up_voxels
