"""State: the per-particle arrays that a scene requires, and no others."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import warp as wp

from .execution.copies import zero
from .model import Model

# The engine's own arrays: None for numbers, 3 for vectors, 9 for matrices.
FIELDS: dict[str, int | None] = {
    "position": 3,
    "velocity": 3,
    "mass": None,
    "inverse_mass": None,
    "radius": None,
    "force": 3,
    "half_velocity": 3,  # of half a substep, where that of its end is predicted for the forces
    "half_velocity_error": 3,
    "force_slope": 9,  # df/dv of the forces that are implicit in the velocity
    "implicit_force": 3,  # their sum, where the method does not damp by all forces
    "velocity_lead": 3,  # how far ahead the velocity is that these are taken at
    "position_error": 3,  # what rounding has kept from x, compensated sums
    "velocity_error": 3,
    "correction": 3,  # what the constraints have moved x by in this substep
    "previous_position": 3,  # x at the start of the substep, for friction and damping
    "smoothing_length": None,  # where each particle has its own
    "density": None,
    "pressure": None,
}
OF_WORLDS = frozenset({"time", "box"})  # a row a world
START = frozenset({"position", "velocity", "mass", "radius"})  # come from the scene; others: zero


class State:
    """Warp arrays by name: ``state.position`` is the (n,) vec3 array on the device.

    Arrays exist only if something has required them; asking for another raises AttributeError
    with the list of those that do.
    """

    def __init__(self, model: Model):
        self._model = model
        self.arrays: dict[str, wp.array] = {}
        self.count = model.particle_count

    def require(self, names: Iterable[str]) -> None:
        """Allocate the arrays of these names that do not exist yet, with their start values."""
        model = self._model
        for name in sorted(names):
            if name in self.arrays:
                continue
            if name == "image":
                self.arrays[name] = model.array(self.start(name), wp.vec3i)
            elif name == "world":
                self.arrays[name] = model.array(model.world_of, wp.int32)
            elif name == "box":
                self.arrays[name] = model.numbers(model.box)
            elif name == "time":
                self.arrays[name] = wp.zeros(
                    model.world_count, dtype=wp.float64, device=model.device
                )
            else:
                self.arrays[name] = self._new(name)

    def held(self, name: str) -> wp.array:
        """The array of that name; of what the scene gives and does not require, its values."""
        if name not in self.arrays and self.is_given(name):
            return self._new(name)
        return self[name]

    def is_given(self, name: str) -> bool:
        """Whether the particles of the scene come with it, as with masses and attributes."""
        return name in START or name == "inverse_mass" or name in self._model.attributes

    def _new(self, name: str) -> wp.array:
        model, dtype, start = self._model, self.dtype(name), self.start(name)
        if start is None:
            return wp.zeros(self.count, dtype=dtype, device=model.device)
        return model.array(start.astype(model.precision.numpy), dtype)

    def start(self, name: str) -> np.ndarray | None:
        """Start values of an array on the host; None: zeros."""
        model = self._model
        if name == "inverse_mass":
            pinned = model.column("pinned") > 0
            return np.where(pinned, 0.0, 1.0 / np.maximum(model.column("mass"), 1e-300))
        if name == "box":
            return model.boxes_at_start()
        if name in ("position", "image"):
            x, image = model.wrapped(model.column("position"), model.world_of, model.box_start)
            return x if name == "position" else image.astype(np.int32)
        if name in START or name in model.attributes:
            return model.column(name)
        return None

    def dtype(self, name: str) -> Any:
        """Warp type of an array's entries."""
        precision = self._model.precision
        width = FIELDS.get(name, self._model.attributes.get(name))
        if name not in FIELDS and name not in self._model.attributes:
            known = sorted({*FIELDS, *self._model.attributes} - {"pinned"})
            raise ValueError(
                f"State: name must be one of {', '.join(known)}, got {name!r}; give the particles "
                f"an attribute of that name."
            )
        return {None: precision.scalar, 3: precision.vec3, 9: precision.mat33}[width]

    def __getitem__(self, name: str) -> wp.array:
        if name not in self.arrays:
            raise AttributeError(
                f"State: name must be one of {', '.join(sorted(self.arrays))}, got {name!r}; "
                "the scene does not require this array."
            )
        return self.arrays[name]

    def __getattr__(self, name: str) -> wp.array:
        if name.startswith("_") or name == "arrays":
            raise AttributeError(name)
        return self[name]

    def unwrapped(self) -> np.ndarray:
        """Positions as without periodic boxes, x + n L with the image n, (n, 3) float64."""
        x = self["position"].numpy().astype(np.float64)
        if "image" in self.arrays:
            x += self["image"].numpy() * self._model.box_length[self._model.world_of]
        return x

    def __contains__(self, name: str) -> bool:
        return name in self.arrays

    def clear_forces(self) -> None:
        """Set all forces, and how they answer to velocities, to zero where there are any."""
        for name in ("force", "force_slope", "implicit_force"):
            if name in self.arrays:
                zero(self._model, self.arrays[name])

    def reset(self, worlds: Iterable[int]) -> None:
        """Put the rows of these worlds back to their start values."""
        offsets = self._model.offsets
        for name, array in self.arrays.items():
            if name == "world":
                continue
            host = array.numpy().copy()
            start = self.start(name)
            for w in worlds:
                rows = slice(w, w + 1) if name in OF_WORLDS else slice(offsets[w], offsets[w + 1])
                host[rows] = 0 if start is None else start[rows]
            array.assign(host)

    @property
    def bytes_per_particle(self) -> float:
        """Memory of the arrays, over the particles."""
        total = sum(a.capacity for a in self.arrays.values())
        return total / max(1, self.count)
