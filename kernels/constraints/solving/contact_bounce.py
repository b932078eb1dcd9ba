"""Contacts that send bodies off: impulses on the velocities of pairs that have met."""

import functools
from typing import Any

import warp as wp

from ...engine.bounces import ENOUGH, bounces_type
from ...engine.loops import Pairs
from ...precision import Precision, register
from ..constraints import bodies_type
from ..contact import touching_type


def _types(precision: Precision) -> tuple[Any, Any, Any]:
    """Bodies, rows of who touches, and bounces."""
    return bodies_type(precision), touching_type(precision), bounces_type(precision)


@functools.cache
def start_kernel(precision: Precision) -> wp.Kernel:
    """Kernel: what the projection has made of velocities of pairs that bounce is taken back.

    ``rise`` is how much farther apart a bounce takes the pair in a substep; a particle counts as
    many times as light as it has such pairs.
    """
    vec3, real = precision.vec3, precision.scalar
    Bodies, Touching, Bounces = _types(precision)

    @register
    def start_contact_bounce(
        first: int, pairs: Pairs, t: Touching, b: Bodies, bounces: Bounces,
        many_out: wp.array(dtype=real), push_out: wp.array(dtype=real),
    ):  # fmt: skip
        s = first + wp.tid()
        i = pairs.order[s]
        many, taken = real(0.0), vec3()
        for k in range(wp.min(t.found[i], t.room[i])):
            at = t.row[i] + wp.int64(k)
            push_out[at] = real(0.0)
            e = t.entry[at]
            if e.rise > real(0.0) and e.lam > real(0.0):
                many += real(1.0)
                taken += e.n * e.lam
                bounces.again[pairs.world[s]] = 1
        many_out[i] = many
        b.v[i] = b.v[i] - taken * (b.w[i] * b.unit * t.inverse_dt)

    return start_contact_bounce


@functools.cache
def find_kernel(precision: Precision) -> wp.Kernel:
    """Kernel: the impulses that pairs are short of, none below 0 in all (each by both alike).

    dJ = (e v_n - n . v_ij) / (c_i w_i + c_j w_j)
    """
    real = precision.scalar
    Bodies, Touching, Bounces = _types(precision)

    @register
    def find_contact_pushes(
        first: int, pairs: Pairs, t: Touching, b: Bodies, bounces: Bounces,
        many: wp.array(dtype=real), push_io: wp.array(dtype=real), more_out: wp.array(dtype=real),
    ):  # fmt: skip
        s = first + wp.tid()
        i = pairs.order[s]
        world = pairs.world[s]
        if bounces.running[world] == 0 or many[i] == real(0.0):
            return
        for k in range(wp.min(t.found[i], t.room[i])):
            at = t.row[i] + wp.int64(k)
            more_out[at] = real(0.0)
            e = t.entry[at]
            if e.rise > real(0.0) and e.lam > real(0.0):
                j = pairs.order[e.partner]
                target = e.rise * t.inverse_dt
                light = (b.w[i] * many[i] + b.w[j] * many[j]) * b.unit
                short = target - wp.dot(e.n, b.v[i] - b.v[j])
                push = wp.max(push_io[at] + short / light, real(0.0))
                more_out[at] = push - push_io[at]
                if wp.abs(more_out[at]) * light > real(ENOUGH) * target:
                    bounces.again[world] = 1
                push_io[at] = push

    return find_contact_pushes


@functools.cache
def give_kernel(precision: Precision) -> wp.Kernel:
    """Kernel: v += w n dJ."""
    vec3, real = precision.vec3, precision.scalar
    Bodies, Touching, Bounces = _types(precision)

    @register
    def give_contact_pushes(
        first: int, pairs: Pairs, t: Touching, b: Bodies, bounces: Bounces,
        many: wp.array(dtype=real), more: wp.array(dtype=real),
    ):  # fmt: skip
        s = first + wp.tid()
        i = pairs.order[s]
        if bounces.running[pairs.world[s]] == 0 or many[i] == real(0.0):
            return
        total = vec3()
        for k in range(wp.min(t.found[i], t.room[i])):
            at = t.row[i] + wp.int64(k)
            e = t.entry[at]
            if e.rise > real(0.0) and e.lam > real(0.0):
                total += e.n * more[at]
        b.v[i] = b.v[i] + total * (b.w[i] * b.unit)

    return give_contact_pushes
