"""The sum over waves of an Ewald sum, by the kernels of ``nvalchemi-toolkit-ops``."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine.model import Model
from ...engine.state import State
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
            "pip install particlesim[electrostatics]."
        ) from error
    return ewald_kernels


class Waves:
    """The waves of one world, and what they make of its charges.

    Energies and forces are those of the constant 1.

    Args:
        owner: For errors.
        model: With the world.
        w: The world.
        splitting: Its waves and damping.
    """

    def __init__(self, owner: str, model: Model, w: int, splitting: Splitting):
        self.kernels, self.rows = library(owner), model.rows(w)
        self.device, self.real = str(model.device), model.precision.scalar
        count = self.rows.stop - self.rows.start
        box = model.box_length[w]
        if not (box > 0).all():
            raise validate.fail(
                owner, "scene", "be periodic along all axes with method='ewald'", box.tolist(),
                "give Scene(periodic=...), or method='all_pairs'",
            )  # fmt: skip
        self.k = model.array(splitting.waves, model.precision.vec3)
        self.cell = model.array(np.diag(box)[None], model.precision.mat33)
        self.damping = model.array([splitting.damping], self.real)
        shape = (len(splitting.waves), count)
        self.cos, self.sin = (self._zeros(shape) for _ in range(2))
        self.re, self.im = (self._zeros(shape[0]) for _ in range(2))
        self.total = self._zeros(1)  # charge by volume

    def _zeros(self, shape: Any) -> wp.array:
        return wp.zeros(shape, dtype=wp.float64, device=self.device)

    def act(self, state: State, charge: wp.array, energy: wp.array, field: wp.array) -> None:
        """Energies and forces on the world's particles, into their rows."""
        x, q = state.position[self.rows], charge[self.rows]
        self.kernels.ewald_reciprocal_space_fill_structure_factors(
            x, q, self.k, self.cell, self.damping, self.total, self.cos, self.sin, self.re,
            self.im, self.real, self.device,
        )  # fmt: skip
        self.kernels.ewald_reciprocal_space_energy_forces(
            q, self.k, self.cos, self.sin, self.re, self.im, energy[self.rows], field[self.rows],
            self.real, self.device,
        )  # fmt: skip

    def correct(self, charge: wp.array, energy: wp.array, corrected: wp.array) -> None:
        """Take from the energies what charges have by themselves, and by what neutralises them."""
        self.kernels.ewald_subtract_self_energy(
            charge[self.rows], self.damping, self.total, energy[self.rows], corrected[self.rows],
            self.real, self.device,
        )  # fmt: skip
