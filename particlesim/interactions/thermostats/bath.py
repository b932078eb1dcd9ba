"""Bath: what ready thermostats share: members, temperatures, seeds and the count of draws."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine.model import Model
from ...engine.neighbors.lists import Neighbors
from ...engine.state import State
from ...kernels.interactions import thermostat as kernels
from ...scene.group import select
from ...scene.scene import Scene
from ...scene.thermostat import Thermostat


class Bath(Thermostat):
    """A heat bath of a temperature, which draws random numbers.

    They are counted by the number of the particle in its world and by how often the bath has acted
    (:mod:`particlesim.kernels.random`): a run repeats bit for bit, on any number of threads, in a
    batch or alone, and so does one that goes on from a checkpoint.
    """

    def __init__(self, group: Any, temperature: Any, seed: int):
        self.group = group
        self.times, self.temperatures = ramp(self.name, temperature)
        self.seed = validate.whole(self.name, "seed", seed)
        if self.seed >= 2**64:
            raise validate.fail(self.name, "seed", "be below 2^64", self.seed, "give less")

    @property
    def requires(self) -> frozenset[str]:  # type: ignore[override]
        """Of all worlds: the time where a temperature changes."""
        needed = {"velocity", "inverse_mass"}
        if self.model.settings.compensated:
            needed |= {"velocity_error"}
        if any(len(peer.times) > 1 for peer in self.peers):
            needed |= {"time"}
        return frozenset(needed)

    def fastest(self, scene: Scene) -> float:
        mass = scene.mass[select(scene, self.group, self.name)]
        if not len(mass):
            return 0.0
        return float(np.sqrt(self.temperatures.max() / mass.min()))

    def rates(self) -> np.ndarray:
        """How fast each world exchanges energy, (worlds,) [1/time]."""
        raise validate.undefined(self, "rates(self)")

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        self.model = model
        members = model.members([peer.group for peer in self.peers], self.name)
        free = model.column("pinned")[members] == 0
        self.members_host = members[free]
        self.count = len(self.members_host)
        self.world_host = model.world_of[self.members_host]
        self.members = model.array(self.members_host, wp.int32)
        self.world = model.array(self.world_host, wp.int32)
        knots = max(len(peer.times) for peer in self.peers)
        times, values = (
            np.stack([np.pad(getattr(peer, name), (0, knots - len(peer.times)), "edge")
                      for peer in self.peers])
            for name in ("times", "temperatures")
        )  # fmt: skip
        model.fits(self.name, {"temperature": values})
        seeds = np.array([peer.seed for peer in self.peers], dtype=np.uint64)
        keys = np.stack([seeds & np.uint64(2**32 - 1), seeds >> np.uint64(32)], axis=1)
        worlds, first = model.world_count, model.scenes[0].thermostats
        self.acted = wp.zeros(worlds, dtype=wp.int64, device=model.device)
        self.bath = kernels.Bath()
        self.bath.key = model.array(keys.astype(np.uint32), wp.vec2ui)
        self.bath.count = self.acted
        self.bath.times = model.array(times.ravel(), wp.float64)
        self.bath.values = model.array(values.ravel(), wp.float64)
        self.bath.rate = model.array(self.rates(), wp.float64)
        self.bath.decay = wp.zeros(worlds, dtype=wp.float64, device=model.device)
        self.bath.noise = wp.zeros(worlds, dtype=wp.float64, device=model.device)
        self.bath.knots = knots
        self.bath.place = next(k for k, each in enumerate(first) if each is self.peers[0])

    def attach(self, model: Model, state: State) -> None:
        self.time = state.time if "time" in self.requires else None
        self.error = state.velocity_error if model.settings.compensated else None

    def persistent(self) -> dict[str, wp.array]:
        return {"acted": self.acted}

    def worlds(self, name: str, array: wp.array) -> np.ndarray:
        return np.arange(self.model.world_count)

    def reset(self, worlds: Sequence[int]) -> None:
        self.forget(self.persistent(), worlds)


def ramp(owner: str, temperature: Any) -> tuple[np.ndarray, np.ndarray]:
    """Times and temperatures of a number, or of a pair (times, temperatures)."""
    if not isinstance(temperature, tuple | list) and np.ndim(temperature) == 0:
        value = validate.number(owner, "temperature", temperature, minimum=0.0, unit="energy")
        return np.zeros(1), np.array([value])
    if len(temperature) != 2 or not 1 <= np.size(temperature[0]) == np.size(temperature[1]):
        raise validate.fail(
            owner, "temperature", "be a number or (times, temperatures) of one length",
            temperature, "give as many temperatures as times",
        )  # fmt: skip
    times = validate.rows(owner, "temperature times", temperature[0], np.size(temperature[0]), None)
    values = validate.rows(owner, "temperature", temperature[1], len(times), None)
    if (np.diff(times) <= 0).any():
        raise validate.fail(owner, "temperature times", "rise", times.tolist(), "sort them")
    if (values < 0).any():
        worst = float(values.min())
        raise validate.fail(owner, "temperature", "be at least 0", worst, "give energies, k_B T")
    return times, values
