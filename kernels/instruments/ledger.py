"""The ledger's kernels: what a part has changed, and its work and impulse summed by blocks."""

import functools
from typing import Any

import warp as wp

from ..engine.integrate import widened
from ..precision import Precision, register, structure

TOTALS = wp.types.vector(length=7, dtype=wp.float64)  # work, impulse (3), angular impulse (3)


def ledger_type(precision: Precision) -> Any:
    """What all accounts read: blocks, masses, and the motion as a substep began and is now."""
    vec3, real = precision.vec3, precision.scalar
    fields = {
        "begin": wp.array(dtype=wp.int32),  # of a block, and its end
        "end": wp.array(dtype=wp.int32),
        "m": wp.array(dtype=real),
        "w": wp.array(dtype=real),
        "x0": wp.array(dtype=vec3),
        "v0": wp.array(dtype=vec3),
        "x": wp.array(dtype=vec3),
        "v": wp.array(dtype=vec3),
    }
    return structure(f"Ledger_{precision.name}", fields)


@functools.cache
def change_kernel(precision: Precision) -> wp.Kernel:
    """Kernel: what has been added to an array since it was seen; ``more``: to what was noted."""
    vec3 = precision.vec3

    @register
    def note_change(
        first: int,
        array: wp.array(dtype=vec3),
        seen: wp.array(dtype=vec3),
        more: int,
        change_io: wp.array(dtype=vec3),
    ):
        i = first + wp.tid()
        change = array[i] - seen[i]
        if more != 0:
            change = change_io[i] + change
        change_io[i] = change

    return note_change


@functools.cache
def account_kernel(precision: Precision) -> wp.Kernel:
    """Kernel: totals of a block += work J.(v0 + v)/2, impulse J and x0 x J_early + x x J_late.

    J = J_early + J_late are the part's impulses on a particle in this substep: its changes times
    their scales, and times the mass where they are changes of velocity. Pinned particles, which no
    impulse moves, are left out. One thread sums one block, one particle after the other.
    """
    vec3, real = precision.vec3, precision.scalar
    Ledger, wide = ledger_type(precision), widened(precision)

    @register
    def account(
        first: int,
        g: Ledger,
        early: wp.array(dtype=vec3),
        late: wp.array(dtype=vec3),
        early_scale: wp.float64,
        late_scale: wp.float64,
        of_velocity: int,
        total_io: wp.array(dtype=TOTALS),
    ):
        b = first + wp.tid()
        work = wp.float64(0.0)
        impulse = wp.vec3d()
        angular = wp.vec3d()
        for i in range(g.begin[b], g.end[b]):
            if g.w[i] > real(0.0):
                factor = wp.float64(1.0)
                if of_velocity != 0:
                    factor = wp.float64(g.m[i])
                J_early = wide(early[i]) * (early_scale * factor)
                J_late = wide(late[i]) * (late_scale * factor)
                J = J_early + J_late
                work += wp.float64(0.5) * wp.dot(J, wide(g.v0[i]) + wide(g.v[i]))
                impulse += J
                angular += wp.cross(wide(g.x0[i]), J_early) + wp.cross(wide(g.x[i]), J_late)
        total = total_io[b]
        total[0] = total[0] + work
        for a in range(3):
            total[1 + a] = total[1 + a] + impulse[a]
            total[4 + a] = total[4 + a] + angular[a]
        total_io[b] = total

    return account
