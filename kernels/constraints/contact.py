"""Contacts of particles: the copies that their pair passes read, and the overlap of a start."""

import functools
from typing import Any

import warp as wp

from ..engine.easing import ease_function, easing_type
from ..engine.loops import Pairs, Periodicity, box_type, minimum_image
from ..precision import Precision, function, register, structure
from .constraints import bodies_type


def contact_types(precision: Precision) -> tuple[Any, Any]:
    """Slot-ordered copies, and what the count of contacts writes."""
    vec3, real = precision.vec3, precision.scalar
    data = {
        "x": wp.array(dtype=vec3),
        "slot": wp.array(dtype=wp.int32),
        "radius": wp.array(dtype=real),  # less the slack
        "share": wp.array(dtype=real),  # w unit times the ways that normals are split
        "grip": wp.array(dtype=real),  # w unit times the ways that friction is split
        "way": wp.array(dtype=vec3),  # of this substep; for bounces the velocity that it began with
        "v": wp.array(dtype=vec3),  # for bounces
        "virial": wp.array(dtype=wp.float64),  # of each particle in this substep, twice its share
        "inverse_dt": real,
        "unit": real,  # of mass, as of the bodies
    }
    shares = {
        "share": wp.array(dtype=real),
        "grip": wp.array(dtype=real),
        "w": wp.array(dtype=real),
        "unit": real,
        "relaxation": real,
    }
    return (
        structure(f"ContactData_{precision.name}", data),
        structure(f"ContactShares_{precision.name}", shares),
    )


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
            if j != i and r < factor * reach and b.w[i] + b.w[j] > real(0.0):
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
        virial_out: wp.array(dtype=wp.float64),
    ):
        """And the virial of a substep begins."""
        i = pairs.order[first + wp.tid()]
        virial_out[i] = wp.float64(0.0)
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
def gather_kernel(precision: Precision, compensated: bool) -> wp.Kernel:
    """Kernel: positions, radii and ways into slot order."""
    real, seen = precision.scalar, seen_function(precision, compensated)
    Bodies, (Data, _) = bodies_type(precision), contact_types(precision)

    @register
    def gather_contacts(
        first: int,
        pairs: Pairs,
        b: Bodies,
        radius: wp.array(dtype=real),
        slack: wp.array(dtype=real),
        eased: real,
        dt: real,
        follow: real,
        d_out: Data,
    ):
        s = first + wp.tid()
        i = pairs.order[s]
        d_out.x[s] = seen(s, i, pairs, b)
        d_out.radius[s] = radius[i] - eased * slack[i]
        d_out.way[s] = b.v[i] * dt + b.correction[i] * follow

    return gather_contacts


@functools.cache
def gather_bounce_kernel(precision: Precision, compensated: bool, forces: bool) -> wp.Kernel:
    """Kernel: for a bounce, positions after integration and velocities as the substep began."""
    vec3, real = precision.vec3, precision.scalar
    Bodies, (Data, _) = bodies_type(precision), contact_types(precision)
    seen = seen_function(precision, compensated)

    @register
    def gather_bounces(
        first: int,
        pairs: Pairs,
        b: Bodies,
        f: wp.array(dtype=vec3),
        radius: wp.array(dtype=real),
        slack: wp.array(dtype=real),
        dt: real,
        inverse_dt: real,
        d_out: Data,
    ):
        s = first + wp.tid()
        i = pairs.order[s]
        d_out.x[s] = seen(s, i, pairs, b) - b.correction[i]
        d_out.radius[s] = radius[i] - slack[i]
        v = b.v[i]
        d_out.v[s] = v
        v = v - b.correction[i] * inverse_dt
        if wp.static(forces):
            v = v - f[i] * (b.w[i] * dt)
        d_out.way[s] = v

    return gather_bounces


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
