"""Hash grids over blocks: how many cells along which axes, and where they are."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ...kernels.engine.neighbors import renewal as kernels
from ..model import Model
from .blocks import Block

CELLS_PER_PARTICLE = 4  # bounds the cost of clearing a grid
MAX_CELLS = 256  # along an axis


def grid_over(model: Model, block: Block, reach: float, x: np.ndarray) -> tuple[wp.HashGrid, Any]:
    """A hash grid of so wide cells sized to a block's positions, and its cell coordinates."""
    w, reach = block.world, max(reach, float(np.finfo(model.precision.numpy).tiny))
    lower, upper = x.min(axis=0), x.max(axis=0)
    # A little more than the reach, for the rounding of cell coordinates in float32.
    cells = np.clip(np.floor((upper - lower) / (1.001 * reach)) + 1, 1, MAX_CELLS)
    scale = np.full(3, 1.0 / (1.001 * reach))
    for axis, on in enumerate(model.periodic):
        if on:
            length = model.box_length[w, axis]
            cells[axis] = np.clip(np.floor(length / (1.001 * reach)), 1, MAX_CELLS)
            lower[axis] = model.box_lower[w, axis]
            upper[axis] = lower[axis] + length
    budget = max(4096, CELLS_PER_PARTICLE * len(x))
    while np.prod(cells) > budget:
        cells[np.argmax(cells)] = np.ceil(cells.max() / 2)
    for axis, on in enumerate(model.periodic):
        if on:
            scale[axis] = cells[axis] / model.box_length[w, axis]
    axes, backward = slowest_last(x)
    turn = np.zeros((3, 3))
    turn[range(3), axes] = np.where(backward, -scale, scale)[axes]
    dimensions = (int(c) for c in cells[axes])
    grid = wp.HashGrid(*dimensions, device=model.device, dtype=model.precision.scalar)
    grid.reserve(len(x))
    place = kernels.cells_type(model.precision)()
    place.length = model.precision.vec3(*model.box_length[w])
    place.origin = model.precision.vec3(*np.where(backward, upper, lower))
    place.turn = model.precision.mat33(turn)
    place.first, place.world = block.begin, w
    return grid, place


def slowest_last(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Axes by how far particles in their own order advance along them, and which go backward.

    A grid numbers its cells by the last axis first. Where that is the order of the particles too,
    what a thread writes by particle it reads by slot: two threads ran SPH 2.05 instead of 1.7 times
    as fast as one.
    """
    index = np.arange(len(x)) - 0.5 * (len(x) - 1)
    spread = np.maximum(x.std(axis=0), np.finfo(float).tiny)
    trend = index @ (x - x.mean(axis=0)) / spread
    return np.argsort(np.abs(trend), kind="stable"), trend < 0
