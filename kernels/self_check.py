"""The fast ways on a CPU, tried once a process against Warp's own before they are trusted.

Native loops and packed launches rest on Warp's insides (:mod:`particlesim.kernels.warp_internals`),
which another Warp may have changed. Two particles find each other through a hash grid, and a law
and its derivative are summed over their rows: natively and packed, and by Warp's own loops and
launch.
"""

import functools
import warnings
from typing import Any

import numpy as np
import warp as wp

from .engine.loops import ROWS, Pairs, Periodicity, box_type, native_loop, plain_loop
from .engine.neighbors import cells_type
from .engine.rows import BLOCK, SPARE, row_functions
from .precision import FLOAT64, function, register, structure, translate
from .warp_internals import WRITTEN_FOR, Packed
from .warp_watch import watched

OPEN = Periodicity()
VEC3, PAIR = FLOAT64.vec3, FLOAT64.vector(2)


@functools.cache
def fast_ways() -> bool:
    """Whether native loops and packed launches give what Warp's own give.

    Where they do not, one warning says so, and whoever asked is to fall back on Warp's own.
    """
    try:
        with watched(None):  # now, also where somebody records
            fast, plain = _sums(vectorised=True), _sums(vectorised=False)
        # A sum of one term, with a handful of roundings in it.
        wrong = [] if np.allclose(fast, plain, rtol=1e-14, atol=0.0) else [f"{fast} not {plain}"]
    except Exception as error:
        wrong = [f"{type(error).__name__}: {error}"]
    for reason in wrong:
        warnings.warn(
            f"Simulation: native loops and packed launches fail on Warp {wp.__version__} ({reason})"
            f"; running Warp's own, which are slower: install warp-lang {WRITTEN_FOR}.",
            RuntimeWarning,
            stacklevel=2,
        )
    return not wrong


def _attraction(r2: float, strength: float):
    return strength / (1.5 + r2)


@functools.cache
def _kernel(vectorised: bool) -> wp.Kernel:
    """Kernel: make a row by grid, and sum the law and its slope over it."""
    real, Box, Cells = FLOAT64.scalar, box_type(FLOAT64), cells_type(FLOAT64)
    Data = structure("CheckData", {"x": wp.array(dtype=VEC3)})
    Params = structure("CheckParameters", {"cutoff_squared": real, "strength": real})
    law = translate(_attraction, FLOAT64)

    def law_and_slope(i: int, j: int, x_ij: VEC3, r2: real, d: Data, p: Params):
        slope, _unused = wp.grad(law)(r2, p.strength)
        return PAIR(law(r2, p.strength), slope)

    make = native_loop if vectorised else plain_loop
    loop = make(function(law_and_slope), Data, Params, 2, FLOAT64, OPEN, ROWS)
    _of_range, of_cells = row_functions(FLOAT64, OPEN, vectorised)

    @functools.partial(register, cpu_only=True)
    def check(
        first: int,
        grid: wp.uint64,
        slot: wp.array(dtype=wp.int32),
        planes: wp.array2d(dtype=real),
        x: wp.array(dtype=VEC3),
        pairs: Pairs,
        sums_out: wp.array(dtype=PAIR),
    ):
        i = first + wp.tid()
        one = real(1.0)
        pairs.count[i] = of_cells(
            i, 0, grid, x[i], one, Cells(), slot, SPARE, pairs, Box(), planes, one
        )
        d = Data()
        d.x = x
        p = Params()
        p.cutoff_squared = real(1.0)
        p.strength = real(3.0)
        sums_out[i] = loop(i, pairs, Box(), d, p)

    return check


def _sums(vectorised: bool) -> np.ndarray:
    """The law and its slope for each of two particles, (2, 2); NaN where nothing was written."""
    host = np.array([(0.5, 0.5, 0.5), (1.25, 0.5, 0.5)])  # in cells of their own
    with wp.ScopedDevice("cpu"):
        x = wp.array(host, dtype=VEC3)
        planes = wp.array(np.pad(host.T, ((0, 0), (0, BLOCK))), dtype=FLOAT64.scalar)
        grid = wp.HashGrid(4, 4, 4, dtype=FLOAT64.scalar)
        grid.build(x, 1.0)
        pairs = Pairs()
        pairs.count, pairs.index = wp.zeros(2, dtype=int), wp.zeros(4 * SPARE, dtype=int)
        pairs.row, pairs.entry_stride = wp.array([0, 2 * SPARE], dtype=wp.int64), 1
        sums = wp.full(2, value=PAIR(np.nan), dtype=PAIR)
        slot = wp.array([0, 1], dtype=int)
        inputs: list[Any] = [0, grid.id, slot, planes, x, pairs, sums]
        command = wp.launch(_kernel(vectorised), 2, inputs, record_cmd=vectorised)
        if vectorised:
            Packed(command).function()()
        return sums.numpy()
