"""Skins: how much farther than the cutoff rows reach, by how long the last ones have lasted."""

import functools
from types import SimpleNamespace

import warp as wp

from ...precision import Precision, function, register
from .renewal import blocks_type

IDLE = 64.0  # substeps, after which rows with too thick a skin are not worth keeping
WORTH = 0.7  # of a skin, below which a thinner one is worth new rows
THINNEST, THICKEST = 0.03, 0.6  # skins, in cutoffs
HALF = 0.499  # of a skin: a hair less than half, for the rounding of the distances compared
SPARE = 1.1  # times as thick, for what goes faster than before


@wp.struct
class Skins:
    """How much farther than the cutoff the rows of each world reach.

    Rows of a skin s serve n = 1 + s / 2v substeps, where v is the way a substep of what moves
    fastest. With a build that costs as much as ``dear`` passes over rows without a skin, a substep
    costs (1 + s/c)^3 + dear / n, which is least about where (s/c) (1 + s/c) = sqrt(2 v dear / 3 c).
    """

    thickness: wp.array(dtype=wp.float64)  # [length]
    unit: wp.array(dtype=wp.float64)  # the cutoff c that most have; 0 where nothing is looked for
    since: wp.array(dtype=wp.float64)  # time of the present rows; before any: infinite
    farthest_squared: wp.array(dtype=wp.float32)  # from where it was then
    dear: wp.array(dtype=wp.float64)
    substep: wp.float64


def _best(v: wp.float64, dear: wp.float64):
    """The skin that costs least, at v a substep; both in cutoffs."""
    one, half = wp.float64(1.0), wp.float64(0.5)
    q = wp.sqrt(wp.float64(2.0 / 3.0) * dear * v)
    s = half * (wp.sqrt(one + wp.float64(4.0) * q) - one)
    n = wp.floor(one + half * s / wp.max(v, wp.float64(1e-9)))
    # Whole substeps: so many or one more.
    fewer = wp.float64(2.0) * v * (n - one)
    more = wp.float64(2.0) * v * n
    if wp.pow(one + more, wp.float64(3.0)) + dear / (n + one) < (
        wp.pow(one + fewer, wp.float64(3.0)) + dear / n
    ):
        fewer = more
    return wp.clamp(wp.float64(SPARE) * fewer, wp.float64(THINNEST), wp.float64(THICKEST))


@functools.cache
def skin_kernels() -> SimpleNamespace:
    """Kernels over worlds: rows that reach too far are given up; a skin for those to be made."""
    best = function(_best)

    @functools.partial(register, cpu_only=True)
    def flag_idle(
        first: int,
        skins: Skins,
        time: wp.array(dtype=wp.float64),
        moved: wp.array(dtype=wp.int32),
        any_moved: wp.array(dtype=wp.int32),
    ):
        w = first + wp.tid()
        age = (time[w] - skins.since[w]) / skins.substep
        c = skins.unit[w]
        if age >= wp.float64(IDLE) and age < wp.inf and c > wp.float64(0.0):
            v = wp.float64(0.5) * skins.thickness[w] / age  # at most
            if c * best(v / c, skins.dear[w]) < wp.float64(WORTH) * skins.thickness[w]:
                moved[w] = 1
                any_moved[0] = 1

    @functools.partial(register, cpu_only=True)
    def choose_skins(
        first: int, moved: wp.array(dtype=wp.int32), time: wp.array(dtype=wp.float64), skins: Skins
    ):
        w = first + wp.tid()
        if moved[w] == 0:
            return
        age = wp.max((time[w] - skins.since[w]) / skins.substep, wp.float64(1.0))
        c = skins.unit[w]
        if age < wp.inf and c > wp.float64(0.0):
            v = wp.sqrt(wp.float64(skins.farthest_squared[w])) / age
            skins.thickness[w] = c * best(v / c, skins.dear[w])
        skins.since[w] = time[w]
        skins.farthest_squared[w] = wp.float32(0.0)

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
        half = wp.float64(HALF) * thick
        for phase in range(2):
            if margins_io[phase, w] != real(wp.inf):
                margins_io[phase, w] = real(half * half)

    return set_reach
