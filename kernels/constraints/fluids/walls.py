"""What lies beyond the walls of a fluid: the same fluid at rest, without particles.

A wall at distance d from a particle, taken as the plane that it is there, cuts off a part P(d/h) of
its smoothing function. In a corner of several walls what is open is prod_k (1 - P_k), which is
exact of a Gaussian's right angles. The rest counts as filled (Koschier and Bender 2017, for whom
it is integrated over any surface), and its gradient pushes the particle along the normals.
"""

import functools

import warp as wp

from ...engine.loops import Pairs
from ...interactions.fluid.walls import Surface, normals_of, sight_function
from ...precision import function, register
from ..constraints import bodies_type
from ..rigid_motion import pose_type
from .density import density_types

NODES = 512  # of the table of P from 0 to the end of the support


@functools.cache
def wall_kernel(surface: Surface) -> wp.Kernel:
    """Kernel: what a wall leaves open around every slot that it holds, and h times the gradient."""
    precision, params, sides = surface.precision, surface.params, len(surface.places)
    vec3, real, pair2 = precision.vec3, precision.scalar, precision.vector(2)
    each, normals = precision.vector(sides), normals_of(precision, sides)
    Pose, Bodies, (Data, _) = pose_type(precision), bodies_type(precision), density_types(precision)
    sight, end = sight_function(surface), real(float(NODES))

    def cut_off(t: real, table: wp.array(dtype=pair2)):
        """P and -dP/dt, by lines between nodes; behind a wall P(-t) = 1 - P(t)."""
        at = wp.min(wp.abs(t), end)
        k = wp.min(int(at), NODES - 1)
        f = table[k] + (table[k + 1] - table[k]) * (at - real(k))
        return wp.where(t < real(0.0), real(1.0) - f[0], f[0]), f[1]

    cut = function(cut_off)

    @register
    def close_in(
        first: int,
        pairs: Pairs,
        parameters: wp.array(dtype=params),
        pose: wp.array(dtype=Pose),
        held: wp.array(dtype=wp.int32),
        table: wp.array(dtype=pair2),
        nodes_per_length: wp.array(dtype=real),
        b: Bodies,
        back: real,
        d_io: Data,
    ):
        s = first + wp.tid()
        i = pairs.order[s]
        if held[i] == 0:
            return
        w = pairs.world[s]
        d, N = sight(b.x[i] - d_io.way[s] * back, parameters[w], pose, w)
        away, normal = each(d), normals(N)
        free = d_io.open[s]
        lean = d_io.lean[s]
        for a in range(wp.static(sides)):
            P, f = cut(away[a] * nodes_per_length[w], table)
            n = vec3(normal[a, 0], normal[a, 1], normal[a, 2])
            lean = lean * (real(1.0) - P) + n * (free * f)
            free = free * (real(1.0) - P)
        d_io.open[s] = free
        d_io.lean[s] = lean

    return close_in
