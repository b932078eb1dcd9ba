"""The fast ways on a CPU, tried once a process against Warp's own before they are trusted.

Native loops and packed launches rest on Warp's insides (:mod:`particlesim.kernels.warp_internals`),
which another Warp may have changed. Two clusters of particles find each other, and a law and its
derivative are summed over their rows: natively and packed, and by Warp's own loop and launch.
"""

import functools
import warnings
from collections.abc import Iterable
from typing import Any

import numpy as np
import warp as wp

from .engine.loops import ROWS, Pairs, Periodicity, Term, box_type
from .engine.neighbors.clusters import halving_kernels, supers_type
from .engine.neighbors.columns import SUPER, columns_type
from .engine.neighbors.partners import Pool, partners_kernel
from .engine.neighbors.renewal import blocks_type
from .engine.packed import AHEAD, CLUSTER
from .interactions.pair import pair_kernel
from .precision import FLOAT64, function, structure, translate
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
        # Sums of seven terms, with a handful of roundings in each.
        wrong = [] if np.allclose(fast, plain, rtol=1e-14, atol=0.0) else [f"{fast} not {plain}"]
    except OSError:  # of the cache of kernels, which Warp's own ways write to as well
        raise
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


X = np.array([(0.1 * k, 0.01 * k * k, 0.02 * k) for k in range(2 * CLUSTER)])
N = len(X)


@functools.cache
def _kernel(vectorised: bool) -> tuple[wp.Kernel, Any, Any, Any]:
    """Kernel: sum the law and its slope over a row; with its structs."""
    real = FLOAT64.scalar
    Data = structure("CheckData", {"x": wp.array(dtype=VEC3), "slot": wp.array(dtype=wp.int32)})
    Params = structure("CheckParameters", {"cutoff_squared": real, "strength": real})
    Out = structure("CheckSums", {"sum": wp.array(dtype=PAIR)})
    law = translate(_attraction, FLOAT64)

    def law_and_slope(i: int, j: int, x_ij: VEC3, r2: real, d: Data, p: Params):
        slope, _unused = wp.grad(law)(r2, p.strength)
        return PAIR(law(r2, p.strength), slope)

    def keep(i: int, particle: int, total: PAIR, d: Data, p: Params, o: Out):
        o.sum[i] = total

    types = (Data, Params, Out)
    term = Term(function(law_and_slope), 2)
    kernel = pair_kernel(term, function(keep), *types, FLOAT64, OPEN, ROWS, vectorised)
    return kernel, *types


def _sums(vectorised: bool) -> np.ndarray:
    """The law and its slope summed for each particle, (N, 2); NaN where nothing was written."""
    with wp.ScopedDevice("cpu"):
        pairs, box = _found() if vectorised else _given(), wp.zeros(1, dtype=box_type(FLOAT64))
        kernel, Data, Params, Out = _kernel(vectorised)
        p, d, o = Params(), Data(), Out()
        p.cutoff_squared, p.strength = 1.0, 3.0
        d.x, d.slot = wp.array(np.pad(X, ((0, 1), (0, 0))), dtype=VEC3), _whole(range(N))
        o.sum = wp.full(N, value=PAIR(np.nan), dtype=PAIR)
        inputs: list[Any] = [0, pairs, box, wp.array([p], dtype=Params), d, o]
        command = wp.launch(kernel, 2 if vectorised else N, inputs, record_cmd=vectorised)
        if vectorised:
            Packed(command).function()()
        return o.sum.numpy()


def _whole(values: Iterable[int]) -> wp.array:
    return wp.array(list(values), dtype=wp.int32)


def _pairs(size: int, rows: int) -> Pairs:
    """Clusters of so many slots, with rows of so many entries."""
    pairs, count = Pairs(), N // size
    pairs.order, pairs.world = _whole(range(N)), _whole([0] * N)
    pairs.cluster = _whole(k // size for k in range(N))
    pairs.lead, pairs.count = _whole(range(0, N + 1, size)), _whole([rows] * count)
    pairs.row = wp.array([rows * k for k in range(count)], dtype=wp.int64)
    pairs.index, pairs.entry_stride = _whole([0] * (count * rows + AHEAD)), 1
    return pairs


def _given() -> Pairs:
    """Every slot a cluster, with all others for partners."""
    pairs = _pairs(1, N - 1)
    pairs.index = _whole(j for i in range(N) for j in range(N) if j != i)
    return pairs


def _found() -> Pairs:
    """Rows of clusters as they are found."""
    pairs, real = _pairs(CLUSTER, AHEAD), FLOAT64.scalar
    rows = Pool()
    rows.first, rows.taken = wp.array([0, 2 * AHEAD], dtype=wp.int64), _whole([0])
    columns = np.zeros(1, dtype=columns_type(FLOAT64).numpy_dtype())
    columns["end"] = N
    blocks, supers = blocks_type(FLOAT64)(), supers_type(FLOAT64)()
    blocks.of, blocks.begin, blocks.end = _whole([0] * N), _whole([0]), _whole([N])
    blocks.first = _whole([0, 1])
    blocks.reach_squared = wp.array([[1.0]], dtype=real)
    supers.lead, supers.block, supers.first = _whole([0]), _whole([0]), _whole([0, 1])
    supers.cluster = _whole([0])
    supers.middle, supers.half = (wp.zeros((3, SUPER), dtype=real) for _ in range(2))
    planes = wp.zeros((3, N + 2 * SUPER), dtype=real)
    laid, box = wp.array(columns, dtype=columns_type(FLOAT64)), wp.zeros(1, box_type(FLOAT64))
    x, moved = wp.array(X, dtype=VEC3), _whole([1])
    halve = halving_kernels(FLOAT64, OPEN)
    wp.launch(halve.blocks, 1, [0, moved, laid, box, pairs.order, x, pairs.order, planes])
    wp.launch(halve.supers, 1, [0, moved, laid, box, supers, pairs.order, planes])
    looked = [0, moved, box, blocks, laid, _whole([0]), supers, rows, planes, pairs]
    counts = [_whole([0, 0]), _whole([0])]
    wp.launch(partners_kernel(FLOAT64, OPEN), 1, [*looked, *counts])
    return pairs
