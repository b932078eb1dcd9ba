"""Harmonic bonds, and how stiff a network of them is."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...engine import topology
from ...engine.limit import Limit
from ...engine.model import Model
from ...engine.probe import Probe
from ...scene.law import law
from .bonds import Bonds


@law
def harmonic(r: float, stiffness: float, rest_length: float):
    stretch = r - rest_length
    return 0.5 * stiffness * stretch * stretch


class HarmonicBonds(Bonds):
    """u = k (r - L)^2 / 2.

    Some force fields leave the half out: their k is half of this one.

    Args:
        pairs: (m, 2) indices of the ends.
        stiffness: k [force/length], one or (m,), at least 0.
        rest_length: L [length], one or (m,), in a periodic scene at most half a box; None: the
            distances at the start, there to the nearest image.

    Raises:
        ValueError: Wrong shapes, ends that are the same, negative values.

    Example:
        >>> HarmonicBonds([(0, 1), (1, 2)], stiffness=100.0, rest_length=1.0).pairs.shape
        (2, 2)
    """

    weights: tuple[str, ...] = ("stiffness",)  # what answers to positions, and to velocities

    def __init__(self, pairs: Any, stiffness: Any, rest_length: Any = None) -> None:
        given = 0.0 if rest_length is None else rest_length
        super().__init__(pairs, harmonic, stiffness=stiffness, rest_length=given)
        count = len(self.pairs)
        self.stiffness = topology.per_item(self.name, "stiffness", stiffness, count, minimum=0)
        lengths = topology.per_item(self.name, "rest_length", given, count, minimum=0)
        self.rest_length = None if rest_length is None else lengths

    def items(self, model: Model, w: int) -> dict[str, np.ndarray]:
        lengths = topology.rest_lengths(self.name, model, w, self.pairs, self.rest_length)
        return {"stiffness": self.stiffness, "rest_length": lengths}

    def limits(self, probe: Probe) -> list[Limit]:
        """By the gradient of the force, and at most the bound of Anderson and Morley."""
        if not self.count:
            return []
        columns = [self.columns_of[name] for name in self.weights]
        bounds = [spring_bound(self.members, column, probe.inverse_mass) for column in columns]
        return probe.response(self, (bounds[0], bounds[-1]))

    def complaint(self) -> str:
        """That places are too coarse for the rest lengths."""
        lengths = self.columns_of["rest_length"]
        return self.model.unresolved(self.name, "rest_length", lengths, self.members)


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
