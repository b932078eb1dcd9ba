"""How close particles are, about: the scale of differences."""

from __future__ import annotations

import numpy as np

from ..model import Model

SAMPLE = 1024  # particles whose neighbours are looked for among as many others
CLUMPED = 0.01  # of the mean spacing: closer pairs count as overlapping


def spacing(model: Model, x: np.ndarray, v: np.ndarray, dt: float) -> float:
    """About the distance of the closest particles of a world [length], above 0.

    Looks along each axis at the next few in order, so it may miss the very closest, not the scale.
    Where particles are alone: their radius, how far from the origin they are, or how fast.
    """
    closest = [
        each
        for w in range(model.world_count)
        if (each := _of_world(x[slice(*model.offsets[w : w + 2])])) is not None
    ]
    if closest:
        return min(closest)
    fastest = float(np.abs(v).max(initial=0.0))
    candidates = (
        float(model.column("radius").max(initial=0.0)),
        float(np.abs(x).max(initial=0.0)),
        fastest * dt,
    )
    return next((each for each in candidates if each > 0), 1.0)


def _of_world(x: np.ndarray) -> float | None:
    if len(x) < 2:
        return None
    extent = np.ptp(x, axis=0)
    extent = extent[extent > 1e-9 * extent.max()]
    if not len(extent):
        return None
    mean = float(np.exp(np.log(extent).mean()) / (len(x) ** (1 / len(extent)) - 1 + 1e-9))
    d = _neighbor_distances(x)
    d = d[d > CLUMPED * min(mean, float(extent.max()))]
    return float(d.min(initial=mean))


def _neighbor_distances(x: np.ndarray) -> np.ndarray:
    """Distances of pairs among which close ones are: all, or those next to each other in order."""
    if len(x) <= SAMPLE:
        i, j = np.triu_indices(len(x), 1)
        return np.linalg.norm(x[i] - x[j], axis=1)
    lower, extent = x.min(axis=0), np.ptp(x, axis=0)
    width = max(float(extent.max()), 1e-300) / max(1.0, len(x) ** (1 / 3))
    cell = np.floor((x - lower) / width).astype(np.int64)
    ordered = x[np.lexsort(cell.T)]
    lags = [np.linalg.norm(ordered[lag:] - ordered[:-lag], axis=1) for lag in range(1, 9)]
    return np.concatenate(lags)
