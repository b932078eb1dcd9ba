"""Trace: what a run did, in a few numbers a frame that a finer run should repeat."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...simulation.simulation import Simulation

STILL = 0.01  # of its size: what a scene at rest may creep in the run


@dataclass
class Trace:
    """Energies, centre of mass and spread of every world at the start and after each frame.

    Particles of a chaotic scene part ways, but its sums do not: two good runs agree in them.
    """

    kinetic: list[np.ndarray] = field(default_factory=list)
    energy: list[np.ndarray] = field(default_factory=list)
    center: list[np.ndarray] = field(default_factory=list)
    spread: list[np.ndarray] = field(default_factory=list)
    time: float = 0.0
    mass: np.ndarray | float = 0.0

    def add(self, sim: Simulation) -> None:
        """Append the present state."""
        with np.errstate(all="ignore"):
            now = sim.diagnostics()
            self.kinetic.append(now.kinetic)
            self.energy.append(now.energy)
            x, m = sim.state.unwrapped(), sim.get("mass").astype(np.float64)
            center, spread = [], []
            for w in range(sim.world_count):
                rows = slice(int(sim.model.offsets[w]), int(sim.model.offsets[w + 1]))
                middle = np.average(x[rows], axis=0, weights=m[rows])
                apart = ((x[rows] - middle) ** 2).sum(axis=1)
                center.append(middle)
                spread.append(np.sqrt(np.average(apart, weights=m[rows])))
            self.time, self.mass = sim.time, now.mass
            self.center.append(np.array(center))
            self.spread.append(np.array(spread))

    @property
    def finite(self) -> bool:
        """Everything is a number."""
        parts = (self.kinetic, self.energy, self.center, self.spread)
        return all(bool(np.isfinite(each).all()) for part in parts for each in part)

    def difference(self, other: Trace) -> tuple[float, float]:
        """Largest differences from a finer run: energy, and place.

        The change of energy since the start is compared with the finer run's largest kinetic
        energy and change of energy, with its sign: above zero there is more than there should be.
        (A scene at rest has neither: the scale is at least the energy of creeping a hundredth of
        its size.) The centre of mass and the spread are compared with the spread and the way of the
        finer run.
        """
        with np.errstate(all="ignore"):
            gain, truth = _since_start(self.energy), _since_start(other.energy)
            creep = STILL * np.max(other.spread, axis=0) / max(other.time, 1e-300)
            scale = np.max(other.kinetic, axis=0)
            scale = np.maximum(scale, np.abs(truth).max(axis=0))
            scale = np.maximum(scale, 0.5 * other.mass * creep**2)
            most, least = (gain - truth).max(axis=0), (gain - truth).min(axis=0)
            energy = _ratio(np.where(most >= -least, most, least), scale).ravel()
            center, true_center = np.array(self.center), np.array(other.center)
            way = np.linalg.norm(true_center - true_center[0], axis=2).max(axis=0)
            size = np.max(other.spread, axis=0) + way
            apart = np.linalg.norm(center - true_center, axis=2).max(axis=0)
            wider = np.abs(np.array(self.spread) - np.array(other.spread)).max(axis=0)
            place = _ratio(np.maximum(apart, wider), size)
        return float(energy[np.argmax(np.abs(energy))]), float(place.max())


def _since_start(values: list[np.ndarray]) -> np.ndarray:
    return np.array(values) - values[0]


def _ratio(change: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Change over scale; where there is no scale, any change is too much."""
    result = np.where(change == 0, 0.0, np.copysign(np.inf, change))
    return np.divide(change, scale, out=result, where=scale > 0)
