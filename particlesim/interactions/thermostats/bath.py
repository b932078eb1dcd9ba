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
        self.times, self.temperatures = ramp(self.name, "temperature", temperature, "energy")
        self.seed = validate.whole(self.name, "seed", seed)
        if self.seed >= 2**64:
            raise validate.fail(self.name, "seed", "be below 2^64", self.seed, "give less")

    @property
    def requires(self) -> frozenset[str]:  # type: ignore[override]
        """Of all worlds: the time where a temperature changes."""
        needed = {"velocity", "inverse_mass"}
        if self.model.settings.compensated:
            needed |= {"velocity_error"}
        if any(ramp.knots > 1 for ramp in self.ramps):
            needed |= {"time"}
        return frozenset(needed)

    @property
    def ramps(self) -> list[Any]:
        """What may change in time, as kernels take it."""
        return [self.bath.temperature]

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
        seeds = np.array([peer.seed for peer in self.peers], dtype=np.uint64)
        keys = np.stack([seeds & np.uint64(2**32 - 1), seeds >> np.uint64(32)], axis=1)
        worlds, first = model.world_count, model.scenes[0].thermostats
        self.acted = wp.zeros(worlds, dtype=wp.int64, device=model.device)
        self.bath = kernels.Bath()
        self.bath.key = model.array(keys.astype(np.uint32), wp.vec2ui)
        self.bath.count = self.acted
        self.bath.temperature = self.ramp("temperature", self.heat())
        self.bath.rate = model.array(self.rates(), wp.float64)
        self.bath.decay = wp.zeros(worlds, dtype=wp.float64, device=model.device)
        self.bath.noise = wp.zeros(worlds, dtype=wp.float64, device=model.device)
        self.bath.place = next(k for k, each in enumerate(first) if each is self.peers[0])

    def heat(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Times and temperatures of each world."""
        return [(peer.times, peer.temperatures) for peer in self.peers]

    def ramp(self, what: str, ramps: Sequence[tuple[np.ndarray, np.ndarray]]) -> Any:
        """Times and values of each world as kernels take them."""
        most = max(len(times) for times, _ in ramps)
        padded = [[np.pad(each, (0, most - len(each)), "edge") for each in one] for one in ramps]
        times, values = (np.concatenate(each) for each in zip(*padded, strict=True))
        self.model.fits(self.name, {what: values})
        result = kernels.Ramp()
        result.times = self.model.array(times, wp.float64)
        result.values = self.model.array(values, wp.float64)
        result.knots = most
        return result

    def attach(self, model: Model, state: State) -> None:
        self.time = state.time if "time" in self.requires else None
        self.error = state.velocity_error if model.settings.compensated else None

    def persistent(self) -> dict[str, wp.array]:
        return {"acted": self.acted}

    def worlds(self, name: str, array: wp.array) -> np.ndarray:
        return np.arange(self.model.world_count)

    def reset(self, worlds: Sequence[int]) -> None:
        self.forget(self.persistent(), worlds)


def ramp(
    owner: str, name: str, given: Any, unit: str, minimum: float | None = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Times and values of a number, or of a pair (times, values)."""
    if not isinstance(given, tuple | list) and np.ndim(given) == 0:
        value = validate.number(owner, name, given, minimum=minimum, unit=unit)
        return np.zeros(1), np.array([value])
    if len(given) != 2 or not 1 <= np.size(given[0]) == np.size(given[1]):
        raise validate.fail(
            owner, name, f"be a number or (times, {name}s) of one length", given,
            f"give as many {name}s as times",
        )  # fmt: skip
    times = validate.rows(owner, f"{name} times", given[0], np.size(given[0]), None)
    values = validate.rows(owner, name, given[1], len(times), None)
    if (np.diff(times) <= 0).any():
        raise validate.fail(owner, f"{name} times", "rise", times.tolist(), "sort them")
    if minimum is not None and (values < minimum).any():
        worst = float(values.min())
        raise validate.fail(owner, name, f"be at least {minimum:g} [{unit}]", worst, "give more")
    return times, values
