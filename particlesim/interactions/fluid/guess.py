"""A first guess of smoothing lengths, from how closely particles lie."""

from __future__ import annotations

import numpy as np

LEAF = 24  # particles whose extent tells their density
THIN = 1e-3  # of the longest side, at least, each other one is


def guessed_lengths(x: np.ndarray, mass: np.ndarray, dimension: int, eta: float) -> np.ndarray:
    """h = eta (m / rho)^(1/d) by densities of boxes that particles are halved into, (n,).

    Args:
        x: Positions, (n, 3) [length]. mass: Of each, (n,).
        dimension: d, along the first axes. eta: h in spacings.
    """
    h, todo = np.zeros(len(x)), [np.arange(len(x))]
    whole = np.ptp(x, axis=0)[:dimension].max(initial=0.0)
    while todo:
        rows = todo.pop()
        sides = np.ptp(x[rows], axis=0)[:dimension]
        if len(rows) > LEAF and sides.max() > 0:
            axis = int(sides.argmax())
            halves = np.argpartition(x[rows, axis], len(rows) // 2)
            todo += [rows[halves[: len(rows) // 2]], rows[halves[len(rows) // 2 :]]]
            continue
        # k particles on a side stand k - 1 spacings apart.
        k = max(len(rows) ** (1.0 / dimension), 1.5)
        longest = sides.max(initial=0.0) or THIN * whole or 1.0
        volume = (np.maximum(sides, THIN * longest) * k / (k - 1)).prod()
        h[rows] = eta * (mass[rows] * volume / mass[rows].sum()) ** (1.0 / dimension)
    return h
