"""Damped springs between given pairs."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...engine import topology
from ...engine.model import Model
from ...engine.neighbors.lists import Neighbors
from .harmonic_bonds import HarmonicBonds


class Springs(HarmonicBonds):
    """f_i = -(k (r - L) + c dr/dt) n_ij: linear springs with damping along the spring.

    Args:
        pairs: (m, 2) indices of the ends.
        stiffness: k [force/length], one or (m,), at least 0.
        rest_length: L [length], one or (m,), in a periodic scene at most half a box; None: the
            distances at the start, there to the nearest image.
        damping: c [force time/length], one or (m,), at least 0.

    Raises:
        ValueError: Wrong shapes, ends that are the same, negative values.

    Example:
        >>> Springs([(0, 1), (1, 2)], stiffness=100.0, rest_length=1.0).pairs.shape
        (2, 2)
    """

    reads_velocity = True  # whatever the damping of a world is: worlds go as they go alone
    damped = True
    weights = ("stiffness", "damping")

    def __init__(
        self, pairs: Any, stiffness: Any, rest_length: Any = None, damping: Any = 0.0
    ) -> None:
        super().__init__(pairs, stiffness, rest_length)
        self.damping = topology.per_item(self.name, "damping", damping, len(self.pairs), minimum=0)

    @property
    def depends_on_velocity(self) -> bool:
        return any(peer.damping.any() for peer in self.peers)

    def items(self, model: Model, w: int) -> dict[str, np.ndarray]:
        return {**super().items(model, w), "damping": self.damping}

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        super().prepare(model, neighbors)
        self.conservative = not self.columns_of["damping"].any()
