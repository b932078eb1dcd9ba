"""How often particles are how far from each other."""

import functools

import warp as wp

from ..engine.atomics import add_function
from ..engine.integrate import widened
from ..engine.loops import Periodicity, box_type, minimum_image
from ..precision import Precision, register


@functools.cache
def distances_kernel(precision: Precision, periodic: Periodicity) -> wp.Kernel:
    """Kernel: counts the particles within reach of each centre by their distance, in bins.

    Particles of a world follow each other in ``others``; a particle is not counted about itself.
    """
    vec3, Box = precision.vec3, box_type(precision)
    image, wide = minimum_image(precision, periodic), widened(precision)
    add = add_function()

    @register
    def count_distances(
        first: int,
        centres: wp.array(dtype=wp.int32),
        world: wp.array(dtype=wp.int32),  # of each centre
        others: wp.array(dtype=wp.int32),
        begin: wp.array(dtype=wp.int32),  # of each world's among them, and at the end their number
        box: wp.array(dtype=Box),
        x: wp.array(dtype=vec3),
        reach: wp.float64,
        bins: int,
        count_io: wp.array(dtype=wp.int64),  # of each bin, world by world
    ):
        k = first + wp.tid()
        i = centres[k]
        w = world[k]
        for n in range(begin[w], begin[w + 1]):
            j = others[n]
            d = wide(image(x[j] - x[i], box[w]))
            r2 = wp.dot(d, d)
            if j != i and r2 < reach * reach:
                b = int(wp.sqrt(r2) / reach * wp.float64(bins))
                add(w * bins + wp.min(b, bins - 1), wp.int64(1), count_io)

    return count_distances
