"""The smooth part of a 1/r law between all periodic images, as forces that have it share it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine.execution.launch import launch
from ...engine.model import Model
from ...engine.state import State
from ...kernels.interactions.charges import charge_kernels
from ...scene.group import select
from .mesh import Mesh
from .softening import outside, own
from .splitting import split, split_mesh
from .waves import Waves

METHODS = ("ewald", "particle_mesh_ewald")
ENERGY, VIRIAL = 0, 1  # what the smooth part is asked for


@dataclass(frozen=True)
class Asked:
    """What a world asks of the sum.

    Args:
        group: Which particles have a part.
        constant: k of u = k q_i q_j / r.
        tolerance: What may be left out, in parts.
        cutoff: Of near pairs [length]; None: what costs least.
        softening: s of u = k q_i q_j / sqrt(r^2 + s^2) [length]; None of a law that has none.
    """

    group: Any
    constant: float
    tolerance: float
    cutoff: float | None
    softening: float | None = None


class Images:
    """What all pairs of all images have beyond erfc(a R) / R of the near ones, R^2 = r^2 + s^2.

    The mean is left out: a uniform background neutralises what charges there are.

    Args:
        owner: For errors.
        model: With the worlds.
        method: One of ``METHODS``.
        quantity: What the particles' charges are called.
        worlds: What each world asks for.

    Raises:
        ValueError: An open axis.
        ImportError: ``"ewald"`` without the library.
    """

    def __init__(
        self, owner: str, model: Model, method: str, quantity: str, worlds: Sequence[Asked]
    ):
        self.model, self.quantity = model, quantity
        if not all(model.periodic):
            raise validate.fail(
                owner, "scene", f"be periodic along all axes with method={method!r}",
                list(model.periodic), "give Scene(periodic=...), or choose another method",
            )  # fmt: skip
        parts = [select(model.scenes[w], each.group, owner) for w, each in enumerate(worlds)]
        self.rows = np.concatenate([rows + model.offsets[w] for w, rows in enumerate(parts)])
        divide = split if method == "ewald" else split_mesh
        self.splittings: list[Any] = [
            divide(model.box_length[w], len(parts[w]), each.tolerance, each.cutoff)
            for w, each in enumerate(worlds)
        ]
        self._constants(worlds)
        self.softened = worlds[0].softening is not None
        softening = np.array([each.softening or 0.0 for each in worlds])
        make = Waves if method == "ewald" else Mesh
        self.smooth: Waves | Mesh = make(owner, model, self.splittings, softening, self.total)

    def _constants(self, worlds: Sequence[Asked]) -> None:
        """Of each world, its charges in units of about the largest, which no product rounds."""
        model, real, device = self.model, self.model.precision.scalar, self.model.device
        count = model.particle_count
        q = np.zeros(count)
        q[self.rows] = model.column(self.quantity)[self.rows]
        most = np.array([np.abs(q[model.rows(w)]).max(initial=0.0) for w in range(len(worlds))])
        unit = 2.0 ** np.round(np.log2(np.where(most > 0, most, 1.0)))
        member = np.zeros(count)
        member[self.rows] = 1.0 / unit[model.world_of[self.rows]]
        self.member = model.array(member, real)
        self.taken = wp.zeros_like(self.member)
        self.world = model.array(model.world_of, wp.int32)
        self.constants = model.array([each.constant for each in worlds] * unit**2, wp.float64)
        both = [
            [of(part.damping, each.softening or 0.0) for of in (own, outside)]
            for part, each in zip(self.splittings, worlds, strict=True)
        ]
        self.own = model.array(both, wp.vec2d)
        self.total = wp.zeros(len(worlds), dtype=wp.float64, device=device)
        self.field = wp.zeros(count, dtype=model.precision.vec3, device=device)
        self.energies = wp.zeros(count, dtype=wp.float64, device=device)  # or virials

    def apply(self, state: State) -> None:
        """Add the forces."""
        self._act(state, ENERGY)
        self._launch("force", self.constants, self.world, self.field, state.force)

    def _act(self, state: State, what: int) -> None:
        self._launch("take", state[self.quantity], self.member, self.taken)
        self.smooth.act(state, self.taken, self.energies, self.field, what)

    def _launch(self, name: str, *inputs: Any) -> None:
        kernel = getattr(charge_kernels(self.model.precision), name)
        launch(kernel, self.model.particle_count, inputs, self.model.device)

    def measure(
        self, state: State, near: tuple[wp.array, wp.array], energy: wp.array, virial: wp.array
    ) -> None:
        """Add energies and virials of the particles, near pairs' own of both among them.

        Without softening the energy is homogeneous of degree -1, and the virial is the same.
        """
        self._act(state, ENERGY)
        self._add(near[0], 1.0, 1.0, energy)
        if not self.softened:
            self._add(near[0], 1.0, 1.0, virial)
            return
        self._act(state, VIRIAL)
        self._add(near[1], 0.0, 3.0, virial)  # of the background, whose energy goes as 1 / V

    def _add(self, near: wp.array, own: float, background: float, out: wp.array) -> None:
        self._launch(
            "energy", self.constants, self.world, self.own, self.total, self.taken, self.energies,
            near, own, background, out,
        )  # fmt: skip
