"""How an Ewald sum is split between near pairs and waves, or near pairs and a mesh."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...kernels.interactions.mesh import HIGHEST
from .influence import finest

DEAR = 0.15  # times as long as a wave at a particle a near pair takes
# Times as long as a near pair takes a particle at a node of the mesh, and the transforms at a node.
AT_NODE, TRANSFORM = 0.5, 0.5
ORDERS, CUTOFFS = range(4, HIGHEST + 1), 0.85 ** np.arange(24)  # tried; of half the box


@dataclass(frozen=True)
class Splitting:
    """A damping, and what it leaves to both sides.

    With s^2 = -ln(tolerance) both sums leave out what is exp(-s^2) of what they hold: pairs beyond
    r_c = s / a, and waves beyond k = 2 a s (Kolafa and Perram 1992). Their cost is least together
    at a = sqrt(pi) (c N / V^2)^(1/6) (Fincham 1994).

    Args:
        damping: a [1/length].
        cutoff: Of near pairs [length].
        waves: Half of the wave vectors, of each k and -k one, (K, 3) [1/length].
    """

    damping: float
    cutoff: float
    waves: np.ndarray


def split(box: np.ndarray, count: int, tolerance: float, cutoff: float | None) -> Splitting:
    """The splitting for a box.

    Args:
        box: Its sides, (3,) [length].
        count: Charges in it.
        tolerance: What may be left out, in parts.
        cutoff: Of near pairs [length]; None: what costs least, within half the box.
    """
    s = math.sqrt(-math.log(tolerance))
    if cutoff is None:
        best = math.sqrt(math.pi) * (DEAR * count / float(np.prod(box)) ** 2) ** (1.0 / 6.0)
        cutoff = min(s / best, 0.5 * float(box.min()))
    damping = s / cutoff
    return Splitting(damping, cutoff, _half(box, 2.0 * damping * s))


@dataclass(frozen=True)
class MeshSplitting:
    """A damping, and a mesh that leaves out what near pairs do (see ``influence``).

    Args:
        damping: a [1/length].
        cutoff: Of near pairs [length].
        nodes: Of the mesh along each axis, (3,).
        order: Of the splines.
    """

    damping: float
    cutoff: float
    nodes: np.ndarray
    order: int


def split_mesh(
    box: np.ndarray, count: int, tolerance: float, cutoff: float | None
) -> MeshSplitting:
    """The splitting for a box, by arguments as those of ``split``."""
    s = math.sqrt(-math.log(tolerance))
    tried = float(box.min()) * 0.5 * CUTOFFS if cutoff is None else [cutoff]
    volume, found = float(np.prod(box)), []
    for order in ORDERS:
        for each in tried:
            nodes = _smooth(np.maximum(box * s / each / finest(order, tolerance), order))
            size = float(np.prod(nodes))
            near = count * 4.0 / 3.0 * math.pi * each**3 / volume
            cost = count * (near + AT_NODE * order**3) + TRANSFORM * size * math.log2(size)
            found.append((cost, MeshSplitting(s / each, float(each), nodes, order)))
    return min(found, key=lambda one: one[0])[1]


def _smooth(least: np.ndarray) -> np.ndarray:
    """The smallest numbers from these on that have no prime factor above 7."""
    result = np.ceil(least - 1e-9).astype(int)
    for a, n in enumerate(result):
        while math.gcd(int(n), 210 ** int(n).bit_length()) != n:
            n += 1
        result[a] = n
    return result


def _half(box: np.ndarray, longest: float) -> np.ndarray:
    """Wave vectors of a box up to a length, of k and -k one, the zero left out."""
    most = np.floor(longest * box / (2.0 * np.pi)).astype(int)
    grids = np.meshgrid(*(np.arange(-m, m + 1) for m in most), indexing="ij")
    n = np.stack(grids, axis=-1).reshape(-1, 3)
    first = np.where(n[:, 0] != 0, n[:, 0], np.where(n[:, 1] != 0, n[:, 1], n[:, 2]))
    k = 2.0 * np.pi * n[first > 0] / box
    return k[(k**2).sum(axis=1) <= longest**2]
