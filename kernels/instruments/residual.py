"""By how much constraints are missed at the present positions."""

import functools

import warp as wp

from ..constraints.boundaries.meeting import Form, held_type, meeting_function
from ..constraints.constraint_force import counted_function
from ..constraints.constraints import Solved, bodies_type, rounding_function, view_function
from ..constraints.contact import excludes
from ..constraints.solving.unmet import lack_function, off_function
from ..engine.loops import Pairs, Periodicity, box_type, minimum_image
from ..precision import Precision, register


@functools.cache
def tuples_kernel(law: Solved) -> wp.Kernel:
    """Kernel: C of each tuple; of an inequality what is below 0, of a broken one nothing."""
    real, Box, Tuples, Bodies = law.types
    view, counted = view_function(law), counted_function(law)

    @register
    def miss_tuples(
        first: int,
        box: wp.array(dtype=Box),
        t: Tuples,
        b: Bodies,
        miss_out: wp.array(dtype=real),
    ):
        r = first + wp.tid()
        _X, C, _G = view(r, box, t, b)
        miss_out[r] = counted(C, r, t)

    return miss_tuples


@functools.cache
def off_kernel(law: Solved) -> wp.Kernel:
    """Kernel: |C + alpha (F + beta dC/dt)| / |grad C| of each tuple, in parts of its extent.

    F = lam / dt^2 is the force of its multiplier: what it is off by where it should give way, too.
    """
    real, Box, Tuples, Bodies = law.types
    size, view, damped = law.size, view_function(law), law.damped
    off, lack = off_function(law), lack_function(law)

    @register
    def measure_off(
        first: int,
        box: wp.array(dtype=Box),
        t: Tuples,
        b: Bodies,
        off_out: wp.array(dtype=real),
    ):
        r = first + wp.tid()
        X, C, G = view(r, box, t, b)
        F = wp.float64(t.lam[r]) * t.scale[0] * wp.float64(b.unit)
        if wp.static(damped):
            rate = real(0.0)
            for a in range(wp.static(size)):
                rate = rate + wp.dot(G[a], b.v[t.particle[r][a]])
            F = F + wp.float64(t.item[r].damping) * wp.float64(rate)
        off_out[r] = off(X, G, lack(r, C, F, t))

    return measure_off


@functools.cache
def boundary_kernel(form: Form) -> wp.Kernel:
    """Kernel: how deep each particle is inside of a boundary, on its worst side."""
    sides, precision, params, compensated = form[1:5]
    real, each = precision.scalar, precision.vector(sides)
    Bodies, Held = bodies_type(precision), held_type(precision, sides)
    meet, kept = meeting_function(form), rounding_function(precision, compensated)

    @register
    def miss_boundary(
        first: int,
        parameters: wp.array(dtype=params),
        h: Held,
        b: Bodies,
        miss_out: wp.array(dtype=real),
    ):
        k = first + wp.tid()
        i = h.particle[k]
        w = h.world[k]
        back, _N = meet(i, w, b.x[i], kept(i, b), each(), parameters[w], h)
        miss_out[k] = wp.max(back)

    return miss_boundary


@functools.cache
def contact_kernel(precision: Precision, periodic: Periodicity) -> wp.Kernel:
    """Kernel: R_i + R_j - r of each particle's deepest overlap, by slot; 0 without any."""
    real, Box, Bodies = precision.scalar, box_type(precision), bodies_type(precision)
    image = minimum_image(precision, periodic)

    @register
    def miss_contacts(
        first: int,
        pairs: Pairs,
        box: wp.array(dtype=Box),
        apart_of: wp.array2d(dtype=wp.int32),
        b: Bodies,
        radius: wp.array(dtype=real),
        miss_out: wp.array(dtype=real),
    ):
        s = first + wp.tid()
        i = pairs.order[s]
        deepest = real(0.0)
        c = pairs.cluster[s]
        for k in range(pairs.count[c]):
            j = pairs.order[pairs.index[pairs.row[c] + wp.int64(k) * pairs.entry_stride]]
            r = wp.length(image(b.x[i] - b.x[j], box[pairs.world[s]]))
            deep = radius[i] + radius[j] - r
            deeper = j != i and deep > deepest and b.w[i] + b.w[j] > real(0.0)
            if deeper and not excludes(apart_of, i, j):
                deepest = deep
        miss_out[s] = deepest

    return miss_contacts
