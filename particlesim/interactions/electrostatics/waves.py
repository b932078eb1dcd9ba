"""The sum over waves of an Ewald sum, by the kernels of ``nvalchemi-toolkit-ops``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ...engine.execution.launch import launch
from ...engine.model import Model
from ...engine.state import State
from ...kernels.interactions.charges import weigh_waves
from .softening import shares
from .splitting import Splitting


def library(owner: str) -> Any:
    """The launchers of the library's Ewald kernels.

    Raises:
        ImportError: It is not installed.
    """
    try:
        from nvalchemiops.interactions.electrostatics import ewald_kernels
    except ImportError as error:
        raise ImportError(
            f"{owner}: method 'ewald' takes nvalchemi-toolkit-ops, which is not installed; "
            "pip install particlesim[electrostatics], or take method 'particle_mesh_ewald'."
        ) from error
    return ewald_kernels


class Waves:
    """The waves of all worlds, and what they make of the charges.

    Energies and forces are those of the constant 1.

    Args:
        owner: For errors.
        model: With the worlds.
        splittings: Of each world its waves and damping.
        softening: Of each world.
        total: Charge by volume of each world, which is found anew each time, (worlds,).
    """

    def __init__(
        self, owner: str, model: Model, splittings: Sequence[Splitting], softening: np.ndarray,
        total: wp.array,
    ):  # fmt: skip
        self.kernels = library(owner)
        self.worlds = [
            _World(model, w, each, softening[w], total[w : w + 1])
            for w, each in enumerate(splittings)
        ]

    def act(
        self, state: State, charge: wp.array, energy: wp.array, field: wp.array, what: int
    ) -> None:
        """Energies, or virials, and forces on the particles, into their rows."""
        for each in self.worlds:
            each.act(self.kernels, state, charge, energy, field, what)


class _World:
    def __init__(self, model: Model, w: int, splitting: Splitting, softening: float, total: Any):
        self.rows, self.total = model.rows(w), total
        self.device, self.real = str(model.device), model.precision.scalar
        self.k = model.array(splitting.waves, model.precision.vec3)
        self.cell = model.array(np.diag(model.box_length[w])[None], model.precision.mat33)
        self.damping = model.array([splitting.damping], self.real)
        k2 = (splitting.waves**2).sum(axis=1)
        both = shares(k2, splitting.damping, softening)
        self.weights = [model.array(each, wp.float64) for each in both]
        self.plain = softening == 0.0  # the first of these are all 1
        shape = (len(k2), self.rows.stop - self.rows.start)
        self.cos, self.sin = (self._zeros(shape) for _ in range(2))
        self.re, self.im = (self._zeros(shape[0]) for _ in range(2))

    def _zeros(self, shape: Any) -> wp.array:
        return wp.zeros(shape, dtype=wp.float64, device=self.device)

    def act(
        self, kernels: Any, state: State, charge: wp.array, energy: wp.array, field: wp.array,
        what: int,
    ) -> None:  # fmt: skip
        x, q = state.position[self.rows], charge[self.rows]
        kernels.ewald_reciprocal_space_fill_structure_factors(
            x, q, self.k, self.cell, self.damping, self.total, self.cos, self.sin, self.re,
            self.im, self.real, self.device,
        )  # fmt: skip
        if what or not self.plain:
            inputs = [self.weights[what], self.re, self.im]
            launch(weigh_waves, len(self.k), inputs, self.device)
        kernels.ewald_reciprocal_space_energy_forces(
            q, self.k, self.cos, self.sin, self.re, self.im, energy[self.rows], field[self.rows],
            self.real, self.device,
        )  # fmt: skip
