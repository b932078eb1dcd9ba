"""Rows of particles each of which looks as far as it says: as far as either of two."""

import functools
from types import SimpleNamespace

import warp as wp

from ...precision import Precision, register
from ..atomics import rise_function
from .clusters import supers_type
from .columns import SUPER
from .renewal import blocks_type
from .skin import Skins

ABOVE = 1.0 + 1e-6  # for what single precision has rounded


@functools.cache
def own_reach_kernels(precision: Precision) -> SimpleNamespace:
    """Kernels: reaches that rows are made with, and the longest of each world."""
    real, Blocks, rise = precision.scalar, blocks_type(precision), rise_function()

    @register
    def take_reaches(
        first: int,
        members: wp.array(dtype=wp.int32),
        world: wp.array(dtype=wp.int32),
        moved: wp.array(dtype=wp.int32),
        most: wp.array(dtype=wp.float64),
        factor: real,
        size: wp.array(dtype=real),
        reach_out: wp.array(dtype=real),
    ):
        """``factor`` times a size, and at most what is allowed, also where that is no number."""
        k = first + wp.tid()
        w = world[k]
        if moved[w] != 0:
            i = members[k]
            reach = real(most[w])
            if factor * size[i] < reach:
                reach = factor * size[i]
            reach_out[i] = reach

    @register
    def find_longest(
        first: int,
        members: wp.array(dtype=wp.int32),
        world: wp.array(dtype=wp.int32),
        moved: wp.array(dtype=wp.int32),
        reach: wp.array(dtype=real),
        longest: wp.array(dtype=wp.float32),
    ):
        k = first + wp.tid()
        if moved[world[k]] != 0:
            rise(world[k], wp.float32(reach[members[k]]), longest)

    @register
    def set_cutoffs(
        first: int,
        moved: wp.array(dtype=wp.int32),
        longest_io: wp.array(dtype=wp.float32),
        blocks: Blocks,
    ):
        """The cutoff of a world is its longest reach."""
        w = first + wp.tid()
        if moved[w] != 0:
            reach = wp.float64(ABOVE) * wp.float64(longest_io[w])
            blocks.cutoff[blocks.first[w], 0] = reach
            longest_io[w] = wp.float32(0.0)

    return SimpleNamespace(take=take_reaches, longest=find_longest, cutoffs=set_cutoffs)


@functools.cache
def grown_kernel(precision: Precision) -> wp.Kernel:
    """Kernel: flag worlds in which a size has grown so that ``room`` times it is beyond a reach.

    Unless that is as far as it may be.
    """
    real = precision.scalar

    @register
    def flag_grown(
        first: int,
        members: wp.array(dtype=wp.int32),
        world: wp.array(dtype=wp.int32),
        most: wp.array(dtype=wp.float64),
        room: real,
        size: wp.array(dtype=real),
        reach: wp.array(dtype=real),
        moved: wp.array(dtype=wp.int32),
        any_moved: wp.array(dtype=wp.int32),
    ):
        k = first + wp.tid()
        i = members[k]
        w = world[k]
        if room * size[i] > reach[i] and reach[i] < real(most[w]):
            if moved[w] == 0:
                moved[w] = 1
            if any_moved[0] == 0:
                any_moved[0] = 1

    return flag_grown


@functools.cache
def spreading_kernels(precision: Precision) -> SimpleNamespace:
    """Kernels: reaches with the skin, by slot and by super."""
    real, Supers = precision.scalar, supers_type(precision)

    @register
    def spread_reaches(
        first: int,
        world: wp.array(dtype=wp.int32),
        skins: Skins,
        order: wp.array(dtype=wp.int32),
        reach: wp.array(dtype=real),
        planes_out: wp.array2d(dtype=real),
    ):
        """Squares by slot, in the plane behind the coordinates."""
        i = first + wp.tid()
        far = reach[order[i]] + real(skins.thickness[world[i]])
        planes_out[3, i] = far * far

    @functools.partial(register, cpu_only=True)
    def reach_of_supers(first: int, count: int, planes: wp.array2d(dtype=real), supers: Supers):
        """The longest of each super's slots, in the plane behind the halves of its sides."""
        q = first + wp.tid()
        s = supers.lead[q]
        end = wp.min(s + SUPER, count)
        if q + 1 < supers.lead.shape[0]:
            end = wp.min(end, supers.lead[q + 1])
        most = real(0.0)
        for i in range(s, end):
            most = wp.max(most, planes[3, i])
        supers.half[3, q] = wp.sqrt(most)

    return SimpleNamespace(slots=spread_reaches, supers=reach_of_supers)
