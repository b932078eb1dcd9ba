"""Limits of springs."""

from __future__ import annotations

import numpy as np


def spring_bound(pairs: np.ndarray, weight: np.ndarray, inverse_mass: np.ndarray) -> float:
    """Upper bound of the largest eigenvalue of W^(1/2) K W^(1/2) of a network of springs.

    K = B k B^T has, but for zeros, the eigenvalues of k^(1/2) B^T W B k^(1/2), whose rows are
    springs; by Gershgorin's circles over the springs at either end,

        omega^2 <= max over springs (i, j) of  w_i S_i + w_j S_j,   S_i = sum of k at i

    (Anderson and Morley 1985, for unit weights). Exact for one spring and for a chain of equal
    ones. Turning springs away from each other, and compressing them, only lowers omega.

    Args:
        pairs: (m, 2) particles.
        weight: (m,) stiffness, or damping for the largest rate gamma.
        inverse_mass: w, (n,), 0 for pinned particles.
    """
    if not len(pairs):
        return 0.0
    ends = pairs.ravel()
    at = np.bincount(ends, np.repeat(weight, 2), minlength=len(inverse_mass)) * inverse_mass
    return float(at[pairs].sum(axis=1)[weight > 0].max(initial=0.0))
