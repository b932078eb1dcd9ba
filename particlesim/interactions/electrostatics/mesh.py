"""The smooth part of an Ewald sum by a mesh: smooth particle mesh Ewald (Essmann et al. 1995)."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ...engine.execution.acting import on_host
from ...engine.execution.launch import call, launch
from ...engine.model import Model
from ...engine.state import State
from ...kernels.interactions.mesh import (
    BEFORE,
    HIGHEST,
    column_kernels,
    feel_kernel,
    mesh_type,
    put_kernel,
)
from .influence import influence
from .softening import shares, waves_of
from .splitting import MeshSplitting


class Mesh:
    """The meshes of all worlds, and what they make of the charges.

    Energies and forces are those of the constant 1. The transform is NumPy's, in double precision
    and on the host.

    Args:
        owner: For ``explain``.
        model: With the worlds.
        splittings: Of each world its damping and mesh.
        softening: Of each world.
        total: Charge by volume of each world, which is found anew each time, (worlds,).
    """

    def __init__(
        self, owner: str, model: Model, splittings: Sequence[MeshSplitting],
        softening: np.ndarray, total: wp.array,
    ):  # fmt: skip
        self.owner, self.model, self.total = owner, model, total
        self.nodes = [each.nodes for each in splittings]
        box = model.box_length
        self.weights: list[list[np.ndarray]] = []  # of energies, and of virials
        alone = np.zeros((2, model.world_count, 3))
        for w, each in enumerate(splittings):
            G, overlaps = influence(box[w], each.nodes, each.order, each.damping)
            both = shares(waves_of(box[w], each.nodes), each.damping, softening[w])
            self.weights.append([G * share for share in both])
            alone[:, w] = [[(one * with_itself).sum() for with_itself in overlaps]
                           for one in self.weights[w]]  # fmt: skip
        self.alone = [model.array(each, wp.vec3d) for each in alone]
        sides = np.array(self.nodes)
        self.stored = sides + np.array([0, 0, BEFORE])
        self.first = np.concatenate([[0], np.cumsum(self.stored.prod(axis=1))])
        column = np.concatenate([[0], np.cumsum(sides[:, 0] * sides[:, 1])])
        columns = {
            "lower": model.box_lower, "inverse": sides / box, "nodes": sides,
            "first": self.first[:-1], "column": column[:-1],
            "order": np.array([each.order for each in splittings]),
        }  # fmt: skip
        self.meshes = model.structures(mesh_type(), columns)
        self.world = model.array(model.world_of, wp.int32)
        self.columns, count, device = int(column[-1]), model.particle_count, model.device
        self.column_world = model.array(np.repeat(np.arange(len(sides)), np.diff(column)), wp.int32)
        self.key, self.particle = (
            wp.zeros(2 * count, dtype=wp.int32, device=device) for _ in range(2)  # room for sorts
        )  # fmt: skip
        self.begin = wp.zeros(self.columns + 1, dtype=wp.int32, device=device)
        self.share = wp.zeros((count, 3 * HIGHEST), dtype=wp.float64, device=device)
        self.last = wp.zeros(count, dtype=wp.int32, device=device)
        self.charges, self.potential = (
            wp.zeros(int(self.first[-1]), dtype=wp.float64, device=device) for _ in range(2)
        )

    def act(
        self, state: State, charge: wp.array, energy: wp.array, field: wp.array, what: int
    ) -> None:
        """Energies, or virials, and forces on the particles, into their rows."""
        precision, count = self.model.precision, self.model.particle_count
        if count == 0:
            return
        self._put(state, charge)
        transform = functools.partial(self._solve, what)
        on_host(self.owner, transform, "it uses NumPy's Fourier transform")
        given = [state.position, charge, self.potential, self.alone[what], energy, field]
        self._launch(feel_kernel(precision), count, self.world, *given)

    def _put(self, state: State, charge: wp.array) -> None:
        """Charges onto the mesh, those of each column of nodes by a thread."""
        kernels, count = column_kernels(self.model.precision), self.model.particle_count
        placed, ordered = [state.position, charge], [self.key, self.particle]
        self._launch(kernels.key, count, self.world, *placed, self.columns, *ordered)
        call(functools.partial(wp.utils.radix_sort_pairs, *ordered, count))
        device = self.model.device
        launch(kernels.begin, self.columns + 1, [count, self.key, self.begin], device)
        shares = [self.share, self.last]
        self._launch(kernels.weigh, count, self.world, self.particle, *placed, *shares)
        self._launch(
            put_kernel(), self.columns, self.column_world, self.begin, *shares, self.charges
        )

    def _launch(self, kernel: Any, dim: int, *others: Any) -> None:
        launch(kernel, dim, [self.meshes, *others], self.model.device)

    def _solve(self, what: int) -> None:
        """The potential of what is on the mesh."""
        charges, total = self.charges.numpy(), np.zeros(len(self.nodes))
        result = np.empty_like(charges)
        for w, nodes in enumerate(self.nodes):
            rows = slice(int(self.first[w]), int(self.first[w + 1]))
            rho = charges[rows].reshape(self.stored[w])[:, :, BEFORE:]
            waves = np.fft.rfftn(rho)
            total[w] = waves[0, 0, 0].real / self.model.box_length[w].prod()
            waves *= self.weights[w][what] * nodes.prod()
            u = np.fft.irfftn(waves, s=nodes.tolist(), axes=(0, 1, 2))
            out = result[rows].reshape(self.stored[w])
            out[:, :, BEFORE:] = u
            out[:, :, :BEFORE] = u[:, :, np.arange(-BEFORE, 0) % nodes[2]]
        self.potential.assign(result)
        self.total.assign(total)
