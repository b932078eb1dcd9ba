"""Skins: how much farther than its cutoff each world's rows of a list reach.

A thick skin has rows last and a thin one keeps them short. Which is best follows from how fast
particles move, which the last rows have told by how long they lasted: a rule of the world's own
state, in whatever batch it is. What the rule starts from is in checkpoints. Where
:class:`~particlesim.Settings` gives a skin that one is kept, as is the first one on CUDA, whose
grids have cells for it.
"""

from __future__ import annotations

import math

import numpy as np
import warp as wp

from ...kernels.engine.neighbors import skin as kernels
from ..execution.launch import launch
from ..model import Model
from ..state import State

# Of the cutoff, the first skin; and how many passes over rows a build costs. Measured. Grains have
# few partners, so that rows cost little to hold and much to make.
FIRST, FIRST_OF_CONTACTS = 0.12, 0.4
DEAR, DEAR_OF_CONTACTS = 3.0, 15.0


class Skin:
    """The skins of one list, by world.

    Args:
        model: The model.
        unit: Cutoff that most slots have, (worlds,); 0 where nothing is looked for.
        contacts: Whether only constraints look there, (worlds,).
    """

    def __init__(self, model: Model, unit: np.ndarray, contacts: np.ndarray):
        self.model = model
        given = model.settings.skin
        self.chosen = given is None and model.vectorised
        first = np.where(contacts, FIRST_OF_CONTACTS, FIRST) * unit
        self.first = first if given is None else np.where(unit > 0, given, 0.0)
        self.struct = kernels.Skins()
        self.struct.thickness = model.array(self.first, wp.float64)
        self.struct.unit = model.array(unit, wp.float64)
        self.struct.since = model.array(np.full(len(unit), -np.inf), wp.float64)
        self.struct.farthest_squared = wp.zeros(len(unit), dtype=wp.float32, device=model.device)
        self.struct.dear = model.array(np.where(contacts, DEAR_OF_CONTACTS, DEAR), wp.float64)
        # Of adaptive substeps the number of the start is not known to a run that goes on.
        settings, most = model.settings, model.settings.most_substeps
        usual = settings.substeps if most is None else math.sqrt(most)
        self.struct.substep = float(settings.dt / usual)

    @property
    def thickness(self) -> np.ndarray:
        """At present, (worlds,) [length]."""
        return self.struct.thickness.numpy()

    def persistent(self) -> dict[str, wp.array]:
        """What the next choice starts from."""
        if not self.chosen:
            return {}
        return {"skin": self.struct.thickness, "since": self.struct.since}

    def begin_anew(self, worlds: list[int]) -> None:
        """These worlds are not what they were: their first skins again."""
        for array, first in ((self.struct.thickness, self.first), (self.struct.since, -np.inf)):
            host = array.numpy().copy()
            host[worlds] = np.broadcast_to(first, host.shape)[worlds]
            array.assign(host)

    def flag(self, state: State, moved: wp.array, any_moved: wp.array) -> None:
        """Flag worlds whose rows have lasted so long that shorter ones pay."""
        if self.chosen:
            inputs = [self.struct, state.time, moved, any_moved]
            launch(kernels.skin_kernels().flag_idle, len(moved), inputs, self.model.device)

    def choose(self, state: State, moved: wp.array) -> None:
        """Choose those of the worlds marked as moved, by how far they have, and in what time."""
        if self.chosen:
            inputs = [moved, state.time, self.struct]
            launch(kernels.skin_kernels().choose, len(moved), inputs, self.model.device)
