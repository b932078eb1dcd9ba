"""Series of what is observed over time, and how far two of them are apart."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .observables import Observable
from .statistics import mean

OVER = ("final", "max", "rms", "mean")
WORDS = {
    "final": "at the end",
    "max": "the largest of all frames",
    "rms": "root mean square over all frames",
    "mean": "of the average over all frames",
}


class Series:
    """Values of observables at the start and at some frames, of every world.

    Args:
        observables: What is kept.
        every: Frames from one to the next.
    """

    def __init__(self, observables: Sequence[Observable], every: int = 1):
        self.observables, self.every = observables, every
        self.values: list[list[list[np.ndarray]]] = []  # by time, observable and world

    def add(self, sim: Any) -> None:
        """Keep what is to be seen now, if it is time to; of a start, forget what was before."""
        if sim.frame == 0:
            self.values = []
        if sim.frame % self.every == 0:
            self.values.append([each(sim) for each in self.observables])

    def of(self, observed: int, world: int) -> np.ndarray:
        """What was seen in a world, float64, the start first: (times + 1, ...)."""
        return np.array([each[observed][world] for each in self.values], dtype=np.float64)


@dataclass(frozen=True)
class World:
    """What of a world is compared: lengths of its box (n, 3), 0 where open, and who may move."""

    box: np.ndarray
    free: np.ndarray

    @classmethod
    def all_of(cls, sim: Any) -> list[World]:
        """Those of a simulation."""
        model, found = sim.model, []
        for w, scene in enumerate(sim.scenes):
            count = scene.particle_count
            box = np.broadcast_to(model.box_length[w], (count, 3))
            found.append(cls(box, ~np.asarray(scene.pinned, dtype=bool)))
        return found


@dataclass(frozen=True)
class Apart:
    """How far two series are apart: rms over what is counted, and of the worst of it.

    ``chance``: how large it might be by chance alone, of averages over time (95 %); 0 of others,
    and where the series is too short to tell.
    """

    rms: float
    worst: float
    chance: float = 0.0


@np.errstate(all="ignore")
def shortest(d: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Displacements by the short way round a periodic box of lengths ``box``, 0 where open."""
    turns = np.divide(d, box, out=np.zeros_like(d), where=box > 0)
    return d - box * np.round(turns)


def step_between(seen: Observable, world: World, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a - b, of positions by the short way round."""
    with np.errstate(all="ignore"):
        d = a - b
    return shortest(d, world.box) if seen.wrapped else d


@np.errstate(all="ignore")
def apart(
    seen: Observable, world: World, d: np.ndarray, over: str, counted: np.ndarray | None = None
) -> Apart:
    """The size of differences (times, ...) over time, as ``over`` says.

    Of vectors of particles it is their lengths, of those ``counted`` (n,); of other values their
    magnitudes.
    """
    chance = 0.0
    if over == "final":
        d = d[-1:]
    elif over == "mean":
        chance = 0.0 if seen.particles else _chance(d.reshape(len(d), -1))
        d = d.mean(axis=0, keepdims=True)
    size = np.linalg.norm(d, axis=-1) if seen.particles else np.abs(d)
    size = size.reshape(len(d), -1)
    if counted is not None:
        size = size[:, counted]
    if not size.size:
        return Apart(0.0, 0.0)
    rms, worst = np.sqrt((size**2).mean(axis=1)), size.max(axis=1)
    if over == "rms":
        return Apart(float(np.sqrt((rms**2).mean())), float(np.sqrt((worst**2).mean())))
    return Apart(float(rms.max()), float(worst.max()), chance)


def _chance(d: np.ndarray) -> float:
    """What the averages of series (times, m) may be by chance, root mean square.

    Of differences of two runs: while these stay together there is none, however much they vary.
    """
    reaches = [mean(column).reach() for column in d.T]
    finite = [each for each in reaches if math.isfinite(each)]
    return float(np.sqrt(np.mean(np.square(finite)))) if finite else 0.0


def moving(seen: Observable, world: World, values: np.ndarray) -> np.ndarray | None:
    """Which particles move in a series; where none does, all that are free. None: no particles."""
    if not seen.particles:
        return None
    d = step_between(seen, world, values[1:], values[:1])
    moved = world.free & np.asarray((np.abs(d) > 0).any(axis=(0, 2)))
    return moved if moved.any() else world.free


def scale_of(
    seen: Observable, world: World, values: np.ndarray, counted: np.ndarray | None
) -> float:
    """What errors are compared with: the largest change of a series, or else its largest size."""
    change = step_between(seen, world, values[1:], values[:1])
    for d in (change, values):
        size = apart(seen, world, d, "max", counted).rms
        if size > 0.0:
            return size
    return math.inf
