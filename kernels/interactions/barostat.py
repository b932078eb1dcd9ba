"""Barostats: pressures of worlds, and how their boxes are scaled with all that is in them."""

import functools

import warp as wp

from ..engine.integrate import compensated_sum
from ..engine.loops import box_type
from ..precision import FLOAT64, Precision, register, structure
from ..random import normal_function, philox
from .thermostat import Bath, Ramp, along, change_function, counter

LARGEST = 0.2  # that the root of a volume may change by at once
# Why a world is given up, whose numbers are then made no numbers.
FINE, WILD, NARROW = 0, 1, 2

Piston = structure(
    "Piston",
    {
        "bath": Bath,  # its rate is the compressibility over the relaxation time
        "pressure": Ramp,
        "interval": int,  # substeps from one change to the next
        "due": wp.array(dtype=wp.int32),  # world -> whether it is changed in this substep
        "some_due": wp.array(dtype=wp.int32),
        "shortest": wp.array(dtype=wp.float64),  # world -> side that its forces need
        "stretch": wp.array(dtype=wp.vec3d),  # world -> by how much of itself each side changes
        "fault": wp.array(dtype=wp.int32),
        "side": wp.array(dtype=wp.float64),  # world -> shortest of the box that it was to have
    },
)


@functools.cache
def count_kernel() -> wp.Kernel:
    """Kernel, for each world: whether it is due in this substep."""

    @register
    def count_substep(first: int, p: Piston):
        w = first + wp.tid()
        n = p.bath.count[w] + wp.int64(1)
        p.bath.count[w] = n
        p.due[w] = 0
        if n % wp.int64(p.interval) == wp.int64(0):
            p.due[w] = 1
            p.some_due[0] = 1  # every writer writes the same

    return count_substep


@functools.cache
def work_kernel(precision: Precision) -> wp.Kernel:
    """Kernel, for each block of particles: the sum of m v^2 + r.F, one after the other."""
    vec3, real = precision.vec3, precision.scalar

    @register
    def sum_work(
        first: int,
        edges: wp.array(dtype=wp.int32),
        w: wp.array(dtype=real),
        v: wp.array(dtype=vec3),
        virial: wp.array(dtype=wp.float64),
        sum_out: wp.array(dtype=wp.float64),
    ):
        k = first + wp.tid()
        total = wp.float64(0.0)
        for i in range(edges[k], edges[k + 1]):
            total += wp.float64(wp.dot(v[i], v[i])) / wp.float64(w[i]) + virial[i]
        sum_out[k] = total

    return sum_work


_normal = normal_function(FLOAT64)


@functools.cache
def stretch_kernel(precision: Precision) -> wp.Kernel:
    """Kernel, for each world that is due: its new box.

    Bernetti and Bussi (2020), eq. 7, as a step of the root of the volume, whose noise does not
    depend on it: d lam = -(b lam / 2) (P_0 - P - T / (2 V)) dt + sqrt(b T / 2) dW, V = lam^2, with
    b the compressibility over the relaxation time.
    """
    real, vec3, Box = precision.scalar, precision.vec3, box_type(precision)

    @register
    def stretch_boxes(
        first: int,
        dt: wp.float64,
        time: wp.array(dtype=wp.float64),
        p: Piston,
        blocks: wp.array(dtype=wp.int32),
        sums: wp.array(dtype=wp.float64),
        box_io: wp.array(dtype=Box),
    ):
        w = first + wp.tid()
        if p.due[w] == 0:
            return
        three_PV = wp.float64(0.0)
        for k in range(blocks[w], blocks[w + 1]):
            three_PV += sums[k]
        L = box_io[w].length
        V = wp.float64(L[0]) * wp.float64(L[1]) * wp.float64(L[2])
        half, two, three = wp.float64(0.5), wp.float64(2.0), wp.float64(3.0)
        b = p.bath.rate[w]
        T = along(w, time, p.bath.temperature)
        excess = three_PV / (three * V) - along(w, time, p.pressure)
        bits = philox(counter(-1, w, 0, p.bath), p.bath.key[w])
        xi = _normal(bits[0], bits[1])[0]
        # Of the root of the volume, in parts of it.
        step = half * b * dt * (excess + half * T / V) + wp.sqrt(half * b * T * dt / V) * xi
        scale = wp.pow(wp.float64(1.0) + step, two / three)
        fault = FINE
        if not (wp.abs(step) < wp.float64(LARGEST)):
            fault = WILD
        stretch = wp.vec3d()
        new, inverse = vec3(), vec3()
        for a in range(3):
            new[a] = real(wp.float64(L[a]) * scale)
            inverse[a] = real(1.0) / new[a]
            stretch[a] = (wp.float64(new[a]) - wp.float64(L[a])) / wp.float64(L[a])
        side = wp.float64(wp.min(new))
        if fault == FINE and side < p.shortest[w]:
            fault = NARROW
        p.fault[w] = fault
        p.side[w] = side
        if fault != FINE:
            p.stretch[w] = wp.vec3d(wp.nan, wp.nan, wp.nan)
        else:
            p.stretch[w] = stretch
            box_io[w].length = new
            box_io[w].inverse = inverse

    return stretch_boxes


@functools.cache
def follow_kernel(precision: Precision, compensated: bool) -> wp.Kernel:
    """Kernel: positions as the box, x - lower -> s (x - lower), and velocities v -> v / s."""
    vec3, real, Box = precision.vec3, precision.scalar, box_type(precision)
    change, add = change_function(precision, compensated), compensated_sum(vec3)

    @register
    def follow_box(
        first: int,
        world: wp.array(dtype=wp.int32),
        p: Piston,
        box: wp.array(dtype=Box),
        x_io: wp.array(dtype=vec3),
        x_error_io: wp.array(dtype=vec3),
        v_io: wp.array(dtype=vec3),
        v_error_io: wp.array(dtype=vec3),
    ):
        i = first + wp.tid()
        w = world[i]
        if p.due[w] == 0:
            return
        e = p.stretch[w]
        d, v = x_io[i] - box[w].lower, v_io[i]
        dx, dv = vec3(), vec3()
        for a in range(3):
            dx[a] = real(e[a]) * d[a]
            dv[a] = -real(e[a] / (wp.float64(1.0) + e[a])) * v[a]
        if wp.static(compensated):
            x, error = add(x_io[i], dx, x_error_io[i])
            x_io[i] = x
            x_error_io[i] = error
        else:
            x_io[i] = x_io[i] + dx
        change(i, dv, v_io, v_error_io)

    return follow_box
