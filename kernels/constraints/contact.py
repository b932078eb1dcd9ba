"""Contacts of particles: what each starts a substep with, and the overlap of a start."""

import functools
from typing import Any

import warp as wp

from ..engine.easing import ease_function, easing_type
from ..engine.loops import Pairs, Periodicity, box_type, minimum_image
from ..precision import Precision, function, register, structure
from .constraints import bodies_type

MARGIN = 0.2  # parts of the lesser radius: as far as others push into contact what would not touch
REST = 2.0  # times the speed that forces add in a substep: who comes slower does not bounce


@functools.cache
def entry_type(precision: Precision) -> Any:
    """A pair as the row of one of its two has it, close together in memory."""
    vec3, real = precision.vec3, precision.scalar
    fields = {
        "x_ij": vec3,  # of the pair where the substep began
        "n": vec3,  # and its direction
        "rub": vec3,  # multiplier times direction of friction
        "reach": real,  # the distance that they keep
        "rise": real,  # how much farther apart a bounce takes the pair
        "lack": real,  # how much they are short of it as a sweep begins
        "lam": real,
        "partner": wp.int32,  # the slot of the other one
    }
    return structure(f"Touch_{precision.name}", fields)


@functools.cache
def touching_type(precision: Precision) -> Any:
    """Rows of who touches whom in a substep, by particle; each pair is in the rows of both.

    A row and its multipliers are its particle's own: the two of a pair reckon alike, each by
    itself, so that one thread writes what one particle reads.
    """
    vec3, real = precision.vec3, precision.scalar
    fields = {
        # By slot, as pairs find each other.
        "radius": wp.array(dtype=real),  # less the slack
        "span": wp.array(dtype=real),  # no two touch that are farther apart than both of theirs
        "way": wp.array(dtype=vec3),  # of this substep, as far as it has come
        "x": wp.array(dtype=vec3),  # where the substep began, as pairs see it
        "v": wp.array(dtype=vec3),  # with which it began, before its forces
        "calm": wp.array(dtype=real),  # the way of a substep up to which it rests
        # The way of a bounce that it has part in and that is not settled, now and then.
        "stir": wp.array(dtype=real),
        "stirs": wp.array(dtype=real),
        "share": wp.array(dtype=real),  # w unit times the ways that normals are split
        "grip": wp.array(dtype=real),  # w unit times the ways that friction is split
        # By particle.
        "virial": wp.array(dtype=wp.float64),  # of each particle in this substep, twice its share
        "row": wp.array(dtype=wp.int64),  # where its row begins
        "room": wp.array(dtype=wp.int32),  # entries of it that there is room for
        "found": wp.array(dtype=wp.int32),  # that there are, or would be
        "most": wp.array(dtype=wp.int32),  # in any substep since there was last made room
        "overflow": wp.array(dtype=wp.int32),  # one: some row was full
        # By world.
        "running": wp.array(dtype=wp.int32),  # to be swept again
        "unsettled": wp.array(dtype=wp.int32),  # some pair is still short of its distance
        "entry": wp.array(dtype=entry_type(precision)),  # the rows
        "unit": real,  # of mass, as of the bodies
        "relaxation": real,
        "inverse_dt": real,  # 0 in a static projection
    }
    return structure(f"Touching_{precision.name}", fields)


@function
def excludes(partners: wp.array2d(dtype=wp.int32), i: int, j: int):
    """Whether j is among the partners of i that it does not touch."""
    for k in range(partners.shape[1]):
        if partners[i, k] == j:
            return True
    return False


@functools.cache
def slack_kernels(precision: Precision, periodic: Periodicity) -> tuple[wp.Kernel, wp.Kernel]:
    """Kernels: the slack that leaves no pair overlapping, of marked worlds; and its running out.

    A particle's radius shrinks by the factor r / (R_i + R_j) of its worst pair: no two overlap
    then, since neither factor is larger than that of their own pair.
    """
    real, Box = precision.scalar, box_type(precision)
    Bodies, Easing = bodies_type(precision), easing_type(precision)
    image, ease = minimum_image(precision, periodic), ease_function(precision)

    @register
    def measure_slack(
        first: int,
        pairs: Pairs,
        box: wp.array(dtype=Box),
        marked: wp.array(dtype=wp.int32),
        apart_of: wp.array2d(dtype=wp.int32),
        b: Bodies,
        radius: wp.array(dtype=real),
        dt: real,
        slack_out: wp.array(dtype=real),
    ):
        s = first + wp.tid()
        world = pairs.world[s]
        if marked[world] == 0:
            return
        i = pairs.order[s]
        x_i = b.x[i] - b.v[i] * dt  # where the substep began: the way since is no overlap
        factor = real(1.0)
        c = pairs.cluster[s]
        for k in range(pairs.count[c]):
            j = pairs.order[pairs.index[pairs.row[c] + wp.int64(k) * pairs.entry_stride]]
            reach = radius[i] + radius[j]
            r = wp.length(image(x_i - (b.x[j] - b.v[j] * dt), box[world]))
            deeper = j != i and r < factor * reach and b.w[i] + b.w[j] > real(0.0)
            if deeper and not excludes(apart_of, i, j):
                factor = r / reach
        slack_out[i] = radius[i] * (real(1.0) - factor)

    @register
    def run_out(
        first: int,
        pairs: Pairs,
        radius: wp.array(dtype=real),
        easing: Easing,
        dt: real,
        slack_io: wp.array(dtype=real),
    ):
        i = pairs.order[first + wp.tid()]
        if slack_io[i] > real(0.0):
            slack_io[i] = ease(slack_io[i], radius[i], dt, easing)

    return measure_slack, run_out


def seen_function(precision: Precision, compensated: bool) -> wp.Function:
    """``seen(s, i, pairs, b)``: position of particle i, of slot s, as pairs see it.

    With compensated sums from a particle of the same world: differences far from the origin are
    then as exact as near to it.
    """
    Bodies = bodies_type(precision)

    def seen(s: int, i: int, pairs: Pairs, b: Bodies):
        x = b.x[i]
        if wp.static(compensated):
            o = pairs.order[pairs.begin[pairs.world[s]]]
            x = (x - b.x[o]) + (b.x_error[i] - b.x_error[o])
        return x

    return function(seen)


@functools.cache
def start_kernel(precision: Precision, compensated: bool, forces: bool) -> wp.Kernel:
    """Kernel: of each particle what is reckoned from where the substep began."""
    vec3, real = precision.vec3, precision.scalar
    Bodies, Touching = bodies_type(precision), touching_type(precision)
    seen = seen_function(precision, compensated)

    @register
    def start_contacts(
        first: int,
        pairs: Pairs,
        b: Bodies,
        f: wp.array(dtype=vec3),
        radius: wp.array(dtype=real),
        slack: wp.array(dtype=real),
        eased: real,
        dt: real,
        follow: real,
        t_out: Touching,
    ):
        s = first + wp.tid()
        i = pairs.order[s]
        v = b.v[i]
        way = v * dt + b.correction[i] * follow
        R = radius[i] - eased * slack[i]
        t_out.way[s] = way
        t_out.x[s] = seen(s, i, pairs, b) - way
        t_out.radius[s] = R
        t_out.span[s] = R * real(1.0 + MARGIN) + wp.length(way)
        if wp.static(forces):
            v = v - f[i] * (b.w[i] * dt)
        t_out.v[s] = v
        t_out.calm[s] = real(REST) * wp.length(way - v * dt)

    return start_contacts


@functools.cache
def way_kernel(precision: Precision) -> wp.Kernel:
    """Kernel: how far each particle has come in this substep, and whether it is swept ``again``."""
    real = precision.scalar
    Bodies, Touching = bodies_type(precision), touching_type(precision)

    @register
    def take_ways(
        first: int, pairs: Pairs, b: Bodies, dt: real, follow: real, again: int, t_out: Touching
    ):
        s = first + wp.tid()
        i = pairs.order[s]
        if again != 0:
            t_out.stir[s] = t_out.stirs[s]
        t_out.stirs[s] = real(0.0)
        t_out.way[s] = b.v[i] * dt + b.correction[i] * follow

    return take_ways


@functools.cache
def share_kernel() -> wp.Kernel:
    """Kernel: to each particle its half of the virial of its contacts."""

    @register
    def share_virial(
        first: int, twice: wp.array(dtype=wp.float64), virial_io: wp.array(dtype=wp.float64)
    ):
        i = first + wp.tid()
        virial_io[i] = virial_io[i] + wp.float64(0.5) * twice[i]

    return share_virial
