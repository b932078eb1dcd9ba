"""The smooth part of an Ewald sum by a mesh: smooth particle mesh Ewald (Essmann et al. 1995)."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ...engine.execution.acting import on_host
from ...engine.execution.launch import launch
from ...engine.model import Model
from ...engine.state import State
from ...kernels.interactions.mesh import feel_kernel, mesh_type, put_kernel
from .influence import influence
from .softening import shares, waves_of
from .splitting import MeshSplitting

MOST = 2.0**61  # of the sums of whole numbers
ROOM = 10.0  # times the charges at the start


class Mesh:
    """The meshes of all worlds, and what they make of the charges.

    Energies and forces are those of the constant 1. The transform is NumPy's, in double precision
    and on the host.

    Args:
        owner: For ``explain``.
        model: With the worlds.
        splittings: Of each world its damping and mesh.
        softening: Of each world.
        charge: Of all particles at the start, 0 of those that have no part.
        total: Charge by volume of each world, which is found anew each time, (worlds,).
    """

    def __init__(
        self, owner: str, model: Model, splittings: Sequence[MeshSplitting],
        softening: np.ndarray, charge: np.ndarray, total: wp.array,
    ):  # fmt: skip
        self.owner, self.model, self.total = owner, model, total
        worlds = range(model.world_count)
        self.nodes = [each.nodes for each in splittings]
        box = model.box_length
        self.first = np.concatenate([[0], np.cumsum([n.prod() for n in self.nodes])])
        amount = [ROOM * np.abs(charge[model.rows(w)]).sum() for w in worlds]
        largest = MOST / np.where(np.array(amount) > 0, amount, 1.0)
        self.scale = 2.0 ** np.floor(np.log2(largest))
        self.weights: list[list[np.ndarray]] = []  # of energies, and of virials
        alone = np.zeros((2, model.world_count, 3))
        for w, each in enumerate(splittings):
            G, overlaps = influence(box[w], each.nodes, each.order, each.damping)
            both = shares(waves_of(box[w], each.nodes), each.damping, softening[w])
            self.weights.append([G * share for share in both])
            alone[:, w] = [[(one * with_itself).sum() for with_itself in overlaps]
                           for one in self.weights[w]]  # fmt: skip
        self.alone = [model.array(each, wp.vec3d) for each in alone]
        columns = {
            "lower": model.box_lower, "inverse": np.array(self.nodes) / box,
            "nodes": np.array(self.nodes), "first": self.first[:-1],
            "order": np.array([each.order for each in splittings]), "scale": self.scale,
        }  # fmt: skip
        self.meshes = model.structures(mesh_type(), columns)
        self.world = model.array(model.world_of, wp.int32)
        rows, device = int(self.first[-1]), model.device
        self.sums = wp.zeros(rows, dtype=wp.int64, device=device)
        self.potential = wp.zeros(rows, dtype=wp.float64, device=device)

    def act(
        self, state: State, charge: wp.array, energy: wp.array, field: wp.array, what: int
    ) -> None:
        """Energies, or virials, and forces on the particles, into their rows."""
        precision = self.model.precision
        self.sums.zero_()
        self._launch(put_kernel(precision), state, charge, self.sums)
        transform = functools.partial(self._solve, what)
        on_host(self.owner, transform, "it uses NumPy's Fourier transform")
        given = self.potential, self.alone[what], energy, field
        self._launch(feel_kernel(precision), state, charge, *given)

    def _launch(self, kernel: Any, state: State, *others: Any) -> None:
        inputs = [self.meshes, self.world, state.position, *others]
        launch(kernel, self.model.particle_count, inputs, self.model.device)

    def _solve(self, what: int) -> None:
        """The potential of what is on the mesh."""
        sums, total = self.sums.numpy(), np.zeros(len(self.nodes))
        result = np.empty(len(sums))
        for w, nodes in enumerate(self.nodes):
            rows = slice(int(self.first[w]), int(self.first[w + 1]))
            waves = np.fft.rfftn(sums[rows].reshape(nodes) / self.scale[w])
            total[w] = waves[0, 0, 0].real / self.model.box_length[w].prod()
            waves *= self.weights[w][what] * nodes.prod()
            result[rows] = np.fft.irfftn(waves, s=nodes.tolist(), axes=(0, 1, 2)).ravel()
        self.potential.assign(result)
        self.total.assign(total)
