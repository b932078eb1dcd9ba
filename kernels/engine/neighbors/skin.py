"""Skins: how much farther than the cutoff rows reach, by how long the last ones have lasted."""

import functools
from types import SimpleNamespace

import warp as wp

from ...precision import Precision, function, register
from .renewal import blocks_type

IDLE = 64.0  # substeps, after which rows with too thick a skin are not worth keeping
WORTH = 0.7  # of a skin, below which a thinner one is worth new rows
THINNEST, THICKEST = 0.03, 0.6  # skins, in cutoffs


@wp.struct
class Skins:
    """How much farther than the cutoff the rows of each world reach.

    Rows of a skin s last until something has moved s/2. With v the way a substep of what moves
    fastest, and a build that costs as much as ``dear`` passes over rows without a skin, a substep
    costs (1 + s/c)^3 + 2 v dear / s, which is least where (s/c) (1 + s/c) = sqrt(2 v dear / 3 c).
    What rows have lasted tells v.
    """

    thickness: wp.array(dtype=wp.float64)  # [length]
    unit: wp.array(dtype=wp.float64)  # the cutoff c that most have; 0 where nothing is looked for
    since: wp.array(dtype=wp.float64)  # time of the present rows; before any: infinite
    dear: wp.array(dtype=wp.float64)
    substep: wp.float64


def _chosen(w: int, now: wp.float64, skins: Skins):
    """The skin that rows from now on are to have, by how long the present ones have lasted."""
    thick, c = skins.thickness[w], skins.unit[w]
    age = wp.max((now - skins.since[w]) / skins.substep, wp.float64(1.0))
    if c == wp.float64(0.0) or age == wp.inf:
        return thick
    moved = wp.float64(0.5) * thick / age
    q = wp.sqrt(wp.float64(2.0 / 3.0) * skins.dear[w] * moved / c)
    best = wp.float64(0.5) * (wp.sqrt(wp.float64(1.0) + wp.float64(4.0) * q) - wp.float64(1.0))
    # Half of the way: what has moved fastest once need not do so again.
    ratio = wp.sqrt(best * thick / c)
    return c * wp.clamp(ratio, wp.float64(THINNEST), wp.float64(THICKEST))


@functools.cache
def skin_kernels() -> SimpleNamespace:
    """Kernels over worlds: rows that reach too far are given up; a skin for those to be made."""
    chosen = function(_chosen)

    @register
    def flag_idle(
        first: int,
        skins: Skins,
        time: wp.array(dtype=wp.float64),
        moved: wp.array(dtype=wp.int32),
        any_moved: wp.array(dtype=wp.int32),
    ):
        w = first + wp.tid()
        if time[w] - skins.since[w] >= wp.float64(IDLE) * skins.substep:
            if chosen(w, time[w], skins) < wp.float64(WORTH) * skins.thickness[w]:
                moved[w] = 1
                any_moved[0] = 1

    @register
    def choose_skins(
        first: int, moved: wp.array(dtype=wp.int32), time: wp.array(dtype=wp.float64), skins: Skins
    ):
        w = first + wp.tid()
        if moved[w] != 0:
            skins.thickness[w] = chosen(w, time[w], skins)
            skins.since[w] = time[w]

    return SimpleNamespace(flag_idle=flag_idle, choose=choose_skins)


@functools.cache
def reach_kernel(precision: Precision) -> wp.Kernel:
    """Kernel over worlds: how far their blocks look, and their slots may move, with their skins."""
    real, Blocks = precision.scalar, blocks_type(precision)

    @register
    def set_reach(
        first: int,
        moved: wp.array(dtype=wp.int32),
        skins: Skins,
        blocks: Blocks,
        margins_io: wp.array2d(dtype=real),
    ):
        w = first + wp.tid()
        if moved[w] == 0:
            return
        thick = skins.thickness[w]
        for k in range(blocks.first[w], blocks.first[w + 1]):
            for other in range(blocks.first[w + 1] - blocks.first[w]):
                reach = blocks.cutoff[k, other] + thick
                blocks.reach_squared[k, other] = real(reach * reach)
        # A hair less than half the skin, for the rounding of the distances compared.
        half = wp.float64(0.499) * thick
        for phase in range(2):
            if margins_io[phase, w] != real(wp.inf):
                margins_io[phase, w] = real(half * half)

    return set_reach
