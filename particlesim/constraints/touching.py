"""Rows of the pairs that touch in a substep."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ..engine.model import Model
from ..engine.neighbors.lists import Rows
from ..kernels.constraints.contact import entry_type, touching_type

FEW = 12  # entries of a row to begin with: as many balls of one size touch another


class Touching(Rows):
    """Who touches whom in a substep, by particle, with the multipliers of each pair.

    Args:
        model: Whose particles.
        rough: Something rubs.
    """

    def __init__(self, model: Model, rough: bool):
        precision, count = model.precision, model.particle_count
        self.model, self.generation = model, 0
        self.struct = struct = touching_type(precision)()
        for name in ("way", "x", "v"):
            setattr(struct, name, self._zeros(count, precision.vec3))
        for name in (
            "radius",
            "span",
            "calm",
            "stir",
            "stirs",
            "share",
            *(["grip"] if rough else []),
        ):
            setattr(struct, name, self._zeros(count, precision.scalar))
        struct.virial = self._zeros(count, wp.float64)
        for name in ("found", "most"):
            setattr(struct, name, self._zeros(count, wp.int32))
        struct.unsettled = self._zeros(model.world_count, wp.int32)
        struct.running = wp.ones(model.world_count, dtype=wp.int32, device=model.device)
        self.sweeps = self._zeros(model.world_count, wp.int32)
        self.flag = self._zeros(1, wp.int32)
        self.overflow = struct.overflow = self._zeros(1, wp.int32)
        struct.unit, struct.relaxation = model.mass_unit, model.settings.relaxation
        self.room = np.full(count, FEW)
        self._make_room()

    def _zeros(self, count: int, dtype: Any) -> wp.array:
        return wp.zeros(count, dtype=dtype, device=self.model.device)

    def _make_room(self) -> None:
        model, precision, struct = self.model, self.model.precision, self.struct
        edges = np.concatenate([[0], np.cumsum(self.room)])
        struct.row = model.array(edges[:-1], wp.int64)
        struct.room = model.array(self.room, wp.int32)
        entries = int(edges[-1])
        struct.entry = self._zeros(entries, entry_type(precision))
        self.generation += 1

    def run(self) -> None:
        """All worlds are to be swept; device work."""
        self.struct.running.fill_(1)
        self.sweeps.zero_()

    def lengthen(self) -> bool:
        """If a row was full: room for as many as were found, and some more."""
        if not self.overflow.numpy()[0]:
            return False
        most = self.struct.most.numpy()
        # Where one has become too short, those of its like will be; few large ones are not these.
        self.room = np.maximum(
            np.where(most > self.room, 2 * most, self.room), int(np.median(most))
        )
        self._make_room()
        self.overflow.zero_()
        return True

    def grow(self) -> bool:
        """The same: each substep makes them anew."""
        return self.lengthen()
