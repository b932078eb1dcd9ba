"""Heat baths: temperatures of worlds, and what a bath makes of velocities."""

import functools

import warp as wp

from ..engine.integrate import compensated_sum
from ..precision import FLOAT64, Precision, function, register, structure
from ..random import gamma_function, normal_function, philox

DRAWS = 64  # that a bath may make of one particle or world in a substep

# What may change in time, of each world.
Ramp = structure(
    "Ramp",
    {
        "times": wp.array(dtype=wp.float64),  # (worlds, knots)
        "values": wp.array(dtype=wp.float64),
        "knots": int,
    },
)
Bath = structure(
    "Bath",
    {
        "key": wp.array(dtype=wp.vec2ui),  # the seed
        "count": wp.array(dtype=wp.int64),  # of how often it has acted
        "temperature": Ramp,
        "rate": wp.array(dtype=wp.float64),  # friction, or one over the relaxation time
        "decay": wp.array(dtype=wp.float64),  # what is added to v is decay v,
        "noise": wp.array(dtype=wp.float64),  # and for Langevin's noise sqrt(w) xi
        "place": int,  # among the thermostats of the scene
    },
)


@function
def along(w: int, time: wp.array(dtype=wp.float64), r: Ramp):
    """Between the knots of the world's ramp in proportion, beyond its ends as there."""
    value = r.values[w * r.knots]
    for k in range(w * r.knots + 1, (w + 1) * r.knots):
        t, before, after = time[w], r.times[k - 1], r.times[k]
        rise = r.values[k] - r.values[k - 1]
        if t >= after:
            value = r.values[k]
        elif t > before:
            value = r.values[k - 1] + rise * ((t - before) / (after - before))
    return value


@function
def counter(i: int, w: int, draw: int, b: Bath):
    """Of the draws for particle i, or -1 for the world itself, as often as the bath has acted."""
    low = wp.uint32(b.count[w] & wp.int64(0xFFFFFFFF))
    high = wp.uint32(b.count[w] >> wp.int64(32))
    return wp.vec4ui(wp.uint32(i), low, high, wp.uint32(b.place * DRAWS + draw))


@function
def lost(x: wp.float64):
    """1 - exp(-x), without cancellation where x is small."""
    half = wp.float64(0.5) * wp.min(x, wp.float64(1.0))
    result = wp.float64(1.0) - wp.exp(-x)
    if x < wp.float64(1.0):
        result = wp.float64(2.0) * wp.exp(-half) * wp.sinh(half)
    return result


def change_function(precision: Precision, compensated: bool) -> wp.Function:
    """``change(i, dv, v, v_error)``: v += dv."""
    vec3 = precision.vec3
    add = compensated_sum(vec3)

    def change(
        i: int, dv: vec3, v_io: wp.array(dtype=vec3), error_io: wp.array(dtype=vec3)
    ):  # fmt: skip
        if wp.static(compensated):
            v, error = add(v_io[i], dv, error_io[i])
            v_io[i] = v
            error_io[i] = error
        else:
            v_io[i] = v_io[i] + dv

    return function(change)


@functools.cache
def langevin_begin_kernel() -> wp.Kernel:
    """Kernel, for each world: c - 1 and sqrt((1 - c^2) T), c = exp(-friction dt)."""

    @register
    def langevin_begin(first: int, dt: wp.float64, time: wp.array(dtype=wp.float64), b: Bath):
        w = first + wp.tid()
        b.count[w] = b.count[w] + wp.int64(1)
        x = b.rate[w] * dt
        b.decay[w] = -lost(x)
        b.noise[w] = wp.sqrt(lost(wp.float64(2.0) * x) * along(w, time, b.temperature))

    return langevin_begin


@functools.cache
def langevin_kernel(precision: Precision, compensated: bool) -> wp.Kernel:
    """Kernel, for each member: v -> c v + sqrt((1 - c^2) T w) xi."""
    vec3, real = precision.vec3, precision.scalar
    normal, change = normal_function(precision), change_function(precision, compensated)

    @register
    def langevin_exchange(
        first: int,
        members: wp.array(dtype=wp.int32),
        number: wp.array(dtype=wp.int32),
        world: wp.array(dtype=wp.int32),
        b: Bath,
        inverse_mass: wp.array(dtype=real),
        v_io: wp.array(dtype=vec3),
        error_io: wp.array(dtype=vec3),
    ):
        k = first + wp.tid()
        i = members[k]
        w = world[k]
        if inverse_mass[i] > real(0.0):
            bits = philox(counter(number[k], w, 0, b), b.key[w])
            xy, z = normal(bits[0], bits[1]), normal(bits[2], bits[3])
            noise = vec3(xy[0], xy[1], z[0]) * (real(b.noise[w]) * wp.sqrt(inverse_mass[i]))
            change(i, v_io[i] * real(b.decay[w]) + noise, v_io, error_io)

    return langevin_exchange


_normal, _gamma = normal_function(FLOAT64), gamma_function(FLOAT64)


@function
def rescaling(w: int, twice: wp.float64, n: int, T: wp.float64, gained: wp.float64, b: Bath):
    """The factor that takes m v^2 in all to what it is in a canonical ensemble of n degrees.

    Bussi, Donadio and Parrinello (2007), eq. A7, with gained = 1 - exp(-dt / tau); its sign as of
    Bussi and Parrinello (2008).
    """
    bits = philox(counter(-1, w, 0, b), b.key[w])
    xy = _normal(bits[0], bits[1])
    others = wp.float64(0.0)  # squares of n - 1 normal numbers
    if n == 2:
        others = xy[1] * xy[1]
    elif n > 2:
        shape = wp.float64(0.5) * wp.float64(n - 1)
        others = wp.float64(2.0) * _gamma(shape, counter(-1, w, 1, b), b.key[w])
    spread = wp.sqrt(gained * T / twice)
    first = wp.sqrt(wp.float64(1.0) - gained) + spread * xy[0]
    factor = wp.sqrt(first * first + spread * spread * others)
    if first < wp.float64(0.0):
        factor = -factor
    return factor


@functools.cache
def rescaling_sum_kernel(precision: Precision) -> wp.Kernel:
    """Kernel, for each block of members: the sum of m v^2, one after the other."""
    vec3, real = precision.vec3, precision.scalar

    @register
    def rescaling_sum(
        first: int,
        members: wp.array(dtype=wp.int32),
        edges: wp.array(dtype=wp.int32),
        inverse_mass: wp.array(dtype=real),
        v: wp.array(dtype=vec3),
        sum_out: wp.array(dtype=wp.float64),
    ):
        k = first + wp.tid()
        total = wp.float64(0.0)
        for row in range(edges[k], edges[k + 1]):
            i = members[row]
            if inverse_mass[i] > real(0.0):
                total += wp.float64(wp.dot(v[i], v[i])) / wp.float64(inverse_mass[i])
        sum_out[k] = total

    return rescaling_sum


@functools.cache
def rescaling_begin_kernel() -> wp.Kernel:
    """Kernel, for each world: its factor less 1, from the sums of its blocks."""

    @register
    def rescaling_begin(
        first: int,
        dt: wp.float64,
        time: wp.array(dtype=wp.float64),
        b: Bath,
        blocks: wp.array(dtype=wp.int32),
        degrees: wp.array(dtype=wp.int32),
        sums: wp.array(dtype=wp.float64),
    ):
        w = first + wp.tid()
        b.count[w] = b.count[w] + wp.int64(1)
        twice = wp.float64(0.0)
        for k in range(blocks[w], blocks[w + 1]):
            twice += sums[k]
        b.decay[w] = wp.float64(0.0)
        if twice > wp.float64(0.0):
            T = along(w, time, b.temperature)
            factor = rescaling(w, twice, degrees[w], T, lost(b.rate[w] * dt), b)
            b.decay[w] = factor - wp.float64(1.0)

    return rescaling_begin


@functools.cache
def rescaling_kernel(precision: Precision, compensated: bool) -> wp.Kernel:
    """Kernel, for each member: v -> factor v."""
    vec3, real = precision.vec3, precision.scalar
    change = change_function(precision, compensated)

    @register
    def rescaling_exchange(
        first: int,
        members: wp.array(dtype=wp.int32),
        world: wp.array(dtype=wp.int32),
        b: Bath,
        inverse_mass: wp.array(dtype=real),
        v_io: wp.array(dtype=vec3),
        error_io: wp.array(dtype=vec3),
    ):
        k = first + wp.tid()
        i = members[k]
        if inverse_mass[i] > real(0.0):
            change(i, v_io[i] * real(b.decay[world[k]]), v_io, error_io)

    return rescaling_exchange
