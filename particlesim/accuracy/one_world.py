"""One world of a batch, read like a simulation of its own: what functions of users look at."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ..instruments.diagnostics import Diagnostics
from ..simulation.access import Access
from ..simulation.simulation import Simulation


class OneWorld(Access):
    """A world of a simulation of several, for functions that are written for one.

    ``whole`` is shared by the worlds of one look, and holds the diagnostics of all of them.
    """

    def __init__(self, sim: Simulation, index: int, whole: list[Diagnostics]):
        self.sim, self.index, self.whole = sim, index, whole
        self.scenes, self.world_count = [sim.scenes[index]], 1
        self.settings, self.device = sim.settings, sim.device
        self.particle_count = self.scenes[0].particle_count

    @property
    def time(self) -> float:
        """Simulated time since the start [s]."""
        return self.sim.time

    @property
    def frame(self) -> int:
        """Frames since the start."""
        return self.sim.frame

    def get(self, name: str) -> np.ndarray:
        """A per-particle array of this world, copied to the host."""
        return self.sim.world(self.index).get(name)

    def world(self, index: int) -> Any:
        """This world, which is the only one."""
        return self.sim.world(range(self.index, self.index + 1)[index])

    def diagnostics(self) -> Diagnostics:
        """Those of this world."""
        if not self.whole:
            self.whole.append(self.sim.diagnostics())
        (whole,), here = self.whole, slice(self.index, self.index + 1)
        return Diagnostics(*(getattr(whole, f.name)[here] for f in dataclasses.fields(whole)))

    def interpolate(self, fluid: Any, points: Any, field: Any, **options: Any) -> np.ndarray:
        """A field of a fluid of this world (see :meth:`particlesim.Simulation.interpolate`)."""
        return self.sim.interpolate(fluid, points, field, **{**options, "world": self.index})

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(
            f"{name} is not to be had of one world of several; give seeds=1, for a Simulation."
        )


def worlds_of(sim: Simulation) -> list[Any]:
    """The simulation itself if it has one world, else its worlds as they are now."""
    if sim.world_count == 1:
        return [sim]
    whole: list[Diagnostics] = []
    return [OneWorld(sim, index, whole) for index in range(sim.world_count)]
