"""Liquids at rest: the lattice that their particles make, and what W sums to there."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from ...engine.model import Model
from .smoothing.smoothing_function import Smoothing

LOOKED_AT, EVEN = 16, 1e-3  # particles, and how far they may be off the spacing
FIT = 0.25  # a sum that is farther from 1 is that of a smoothing length that does not fit


@functools.cache
def lattice_sum(smoothing: Smoothing, dimension: int, ratio: float) -> float:
    """The sum of W over a square lattice, times the volume of a cell; 1 where it is far from it.

    Args:
        smoothing: W.
        dimension: Of the lattice.
        ratio: h over the spacing.
    """
    if not 0.5 < ratio < 16.0:
        return 1.0
    reach = smoothing.support * ratio
    n = np.arange(-math.ceil(reach), math.ceil(reach) + 1)
    square = functools.reduce(np.add.outer, [n**2.0] * dimension)
    counts = np.unique(square[square < reach**2], return_counts=True)
    total = sum(
        count * float(smoothing.weight(math.sqrt(r2) / ratio))
        for r2, count in zip(*counts, strict=True)
    )
    found = smoothing.sigma / ratio**dimension * total
    return found if abs(found - 1.0) < FIT else 1.0


def spacings(fluid: Any, model: Model) -> np.ndarray:
    """Of the lattice that their lightest particles make at the rest density, by world.

    Others are heavier where a start has them under the weight of what is above.
    (m / rho_0)^(1/d) [length], of several fluids by the mean of their volumes; 0 where the fluid
    has no rest density, or no particles.
    """
    found, mass = np.zeros(model.world_count), model.column("mass")
    number = fluid.fluid_numbers()
    for w, peer in enumerate(fluid.peers):
        rows = fluid.pairs.members_host[fluid.pairs.begin_host[w] : fluid.pairs.end_host[w]]
        if len(rows) and peer.fluids.densities:
            own = [rows[number[rows] == k] for k in range(len(peer.fluids.densities))]
            volumes = [
                mass[each].min() / density
                for each, density in zip(own, peer.fluids.densities, strict=True) if len(each)
            ]  # fmt: skip
            found[w] = np.mean(volumes) ** (1.0 / fluid.dimension)
    return found


def lattice_sums(fluid: Any, model: Model, h: np.ndarray) -> np.ndarray:
    """What W sums to in worlds where the fluid starts on that lattice; elsewhere 1."""
    found, x = np.ones(model.world_count), model.column("position")
    for w, spacing in enumerate(fluid.spacings):
        rows = fluid.pairs.members_host[fluid.pairs.begin_host[w] : fluid.pairs.end_host[w]]
        if spacing > 0 and _is_lattice(x[rows], spacing):
            found[w] = lattice_sum(fluid.smoothing, fluid.dimension, float(h[w] / spacing))
    return found


def _is_lattice(x: np.ndarray, spacing: float) -> bool:
    """Most of some particles have their next one at this distance."""
    some = np.unique(np.linspace(0, len(x) - 1, LOOKED_AT).astype(int))
    fits = 0
    for k in some:
        square = ((x - x[k]) ** 2).sum(axis=1)
        square[k] = np.inf
        fits += abs(math.sqrt(square.min()) / spacing - 1.0) < EVEN
    return fits >= 0.75 * len(some)
