"""What tests of samplers share."""

import numpy as np


def nearest_distance(points: np.ndarray, period: np.ndarray | None = None) -> np.ndarray:
    """Distance of every point to its nearest neighbour, by brute force."""
    gap = points[:, None] - points[None]
    if period is not None:
        gap -= period * np.round(gap / period)
    squared = (gap * gap).sum(axis=2)
    np.fill_diagonal(squared, np.inf)
    return np.sqrt(squared.min(axis=1))


# Bad arguments

ORIGIN, ONE = (0, 0, 0), (1, 1, 1)
