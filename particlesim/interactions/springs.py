"""Damped springs between given pairs."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ..engine import topology
from ..engine.execution.launch import launch
from ..engine.limit import Limit
from ..engine.model import Model
from ..engine.neighbors.lists import Neighbors
from ..engine.probe import Probe
from ..engine.state import State
from ..kernels.interactions import bonded as kernels
from ..scene.part import Interaction


class Springs(Interaction):
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

    requires = frozenset({"force"})
    reads_velocity = True  # whatever the damping of a world is: worlds go as they go alone

    def __init__(
        self, pairs: Any, stiffness: Any, rest_length: Any = None, damping: Any = 0.0
    ) -> None:
        self.pairs = topology.tuples(self.name, "pairs", pairs, 2)
        count = len(self.pairs)
        self.stiffness = topology.per_item(self.name, "stiffness", stiffness, count, minimum=0)
        self.damping = topology.per_item(self.name, "damping", damping, count, minimum=0)
        self.rest_length = (
            None
            if rest_length is None
            else topology.per_item(self.name, "rest_length", rest_length, count, minimum=0)
        )

    @property
    def depends_on_velocity(self) -> bool:
        return any(peer.damping.any() for peer in self.peers)

    def links(self) -> np.ndarray:
        """Pairs to draw, (m, 2) indices in the scene."""
        return self.pairs

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        self.model = model
        pairs = self.ends = topology.merged(
            self.name, "pairs", model, [peer.pairs for peer in self.peers]
        )
        lengths = [
            topology.rest_lengths(self.name, model, w, peer.pairs, peer.rest_length)
            for w, peer in enumerate(self.peers)
        ]
        self.lengths = np.concatenate(lengths)
        columns = {
            "stiffness": np.concatenate([peer.stiffness for peer in self.peers]),
            "rest_length": self.lengths,
            "damping": np.concatenate([peer.damping for peer in self.peers]),
        }
        model.fits(self.name, columns)
        self.conservative = not columns["damping"].any()
        rows = topology.incidence(pairs)
        self.count = len(rows["particle"])
        if not self.count:
            return
        self.springs = model.structures(kernels.spring_type(model.precision), columns)
        self.bonds = kernels.Incidence()
        for name, column in rows.items():
            setattr(self.bonds, name, model.array(column, wp.int32))
        self.bonds.world = model.array(model.world_of[rows["particle"]], wp.int32)

    def apply(self, state: State, neighbors: Neighbors, dt: float) -> None:
        force = kernels.force_kernel(self.model.precision, self.model.periodic)
        inputs = [
            self.bonds, self.springs, self.model.box, state.position, state.velocity, state.force
        ] if self.count else []  # fmt: skip
        launch(force, self.count, inputs, self.model.device)

    def limits(self, probe: Probe) -> list[Limit]:
        """By the gradient of the force, and at most the bound of Anderson and Morley."""
        if not self.count:
            return []
        w, offsets = probe.inverse_mass, self.model.offsets
        pairs = np.concatenate([peer.pairs + offsets[k] for k, peer in enumerate(self.peers)])
        columns = [
            np.concatenate([getattr(peer, name) for peer in self.peers])
            for name in ("stiffness", "damping")
        ]
        most = spring_bound(pairs, columns[0], w), spring_bound(pairs, columns[1], w)
        return probe.response(self, most)

    def complaint(self) -> str:
        """That places are too coarse for the rest lengths."""
        return self.model.unresolved(self.name, "rest_length", self.lengths, self.ends)

    def measure(self, state: State, energy: wp.array, virial: wp.array) -> None:
        if not self.count:
            return
        measure = kernels.measure_kernel(self.model.precision, self.model.periodic)
        inputs = [self.bonds, self.springs, self.model.box, state.position, energy, virial]
        launch(measure, self.count, inputs, self.model.device)


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
