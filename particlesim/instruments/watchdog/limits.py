"""Limits: how far and how fast the particles of each world may be before the watchdog barks.

Fast: |v| beyond sqrt(F) times the *pace* of the world, on any axis. The pace is the fastest start,
the extent of the start a frame, or what its thermostats give, whichever is most; F is
``Settings.energy_growth``. In terms of energy: that of a particle is F times the largest there was
cause for, and F times that of crossing the whole scene within a frame. A world may have cause for
it (see :mod:`.trace`); its pace is raised then.

Far: outside ``Scene(bounds=...)``; or where the last bit of a coordinate is more than half the skin
of the scene's neighbour lists or the smallest radius, so that nobody can say any more who touches
whom. A start that is farther out may go twice as far. On periodic axes nothing can leave, nor where
there are neither lists nor radii.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from ... import validate
from ...engine.model import Model
from ...engine.neighbors.lists import Neighbors

GROWN = 1.5  # times as fast as a round has seen: time for another
SLOW = 0.02  # of the pace, below which speeds may grow as they like
FINITE, ESCAPED, FAST = 1, 2, 3  # what may be wrong with a particle
Scales = dict[str, np.ndarray]


class Limits:
    """Bounds of positions and speeds, one row a world, on the host and the device."""

    def __init__(self, model: Model, neighbors: Neighbors):
        self.model = model
        worlds, real = model.world_count, model.precision
        self.corners = [_corners(model.scenes, side) for side in (0, 1)]
        start, _ = model.wrapped(model.column("position"), model.world_of, model.box_start)
        self._check(start)
        self.radius = self._by_world(np.fmax, model.column("radius"))
        self.resolved = self._resolved(neighbors)
        self.start = self._scales(start, model.column("velocity"))
        self.scales = {name: column.copy() for name, column in self.start.items()}
        zeros = np.zeros((worlds, 3))
        self.arrays = {
            "lower": model.array(zeros.astype(real.numpy), real.vec3),
            "upper": model.array(zeros.astype(real.numpy), real.vec3),
            "speed": model.array(zeros[:, 0].astype(real.numpy), real.scalar),
            "quick": model.array(zeros[:, 0].astype(real.numpy), real.scalar),
        }
        self.met = np.zeros(worlds)  # the largest speeds that a round has seen
        self._write()

    def _check(self, x: np.ndarray) -> None:
        world = self.model.world_of
        outside = ((x < self.corners[0][world]) | (x > self.corners[1][world])).any(axis=1)
        if outside.any():
            at = int(np.argmax(outside))
            w = int(world[at])
            raise validate.fail(
                "Scene", "bounds", "hold all particles at the start",
                f"particle {at - int(self.model.offsets[w])} of scene {w} at {x[at].tolist()}",
                "widen the bounds",
            )  # fmt: skip

    def _by_world(self, reduce: Any, values: np.ndarray) -> np.ndarray:
        """Reduce the rows of each world; 0 for a world without particles."""
        offsets = self.model.offsets
        some = np.diff(offsets) > 0
        result = np.zeros((self.model.world_count, *values.shape[1:]))
        if some.any():
            result[some] = reduce.reduceat(values.astype(np.float64), offsets[:-1][some], axis=0)
        return np.nan_to_num(result)

    def _scales(self, x: np.ndarray, v: np.ndarray) -> Scales:
        """Extent, largest coordinate and largest speed of every world; of what is finite."""
        x, v = (np.where(np.isfinite(each), each, np.nan) for each in (x, v))
        farthest = self._by_world(np.fmax, np.abs(x)).max(axis=1)
        size = self._by_world(np.fmax, x) - self._by_world(np.fmin, x)
        length = self.model.box_length
        extent = np.where(length > 0, length, size).max(axis=1) + 2.0 * self.radius
        return {
            # A single point has no extent: its coordinates are on some scale, too.
            "extent": np.where(extent > 0, extent, farthest),
            "farthest": farthest,
            "pace": np.fmax(self._by_world(np.fmax, np.abs(v)).max(axis=1), self._warmth()),
        }

    def _warmth(self) -> np.ndarray:
        """The largest speeds that thermostats are there to give, (worlds,)."""
        scenes = self.model.scenes
        return np.array(
            [max((each.fastest(s) for each in s.thermostats), default=0.0) for s in scenes]
        )

    def _resolved(self, neighbors: Neighbors) -> np.ndarray:
        """Coordinates up to which positions serve the scene, (worlds,)."""
        radius = self.model.column("radius")
        smallest = self._by_world(np.fmin, np.where(radius > 0, radius, np.nan))
        skins = [(each.cutoff > 0, each.skin.first) for each in neighbors.verlet]
        lengths = [0.5 * np.where(looking, first, np.inf) for looking, first in skins]
        lengths += [np.where(smallest > 0, smallest, np.inf)]
        return np.min(lengths, axis=0) / float(np.finfo(self.model.precision.numpy).eps)

    def reset(self, worlds: Iterable[int]) -> None:
        """These worlds are at their start again."""
        chosen = list(worlds)
        for name, column in self.scales.items():
            column[chosen] = self.start[name][chosen]
        self._write()

    def follow(self, x: np.ndarray, v: np.ndarray, worlds: Iterable[int]) -> None:
        """Positions and velocities were given to ``worlds``: larger ones are theirs by right."""
        chosen = list(worlds)
        for name, column in self._scales(x, v).items():
            mine = self.scales[name]
            mine[chosen] = np.maximum(mine[chosen], column[chosen])
        self._write()

    def allow(self, speeds: dict[int, float]) -> None:
        """These worlds have cause for such speeds."""
        for w, speed in speeds.items():
            self.scales["pace"][w] = max(self.scales["pace"][w], speed)
        self._write()

    def meet(self, speeds: np.ndarray) -> None:
        """A round has seen such speeds, (worlds,): to be called for where they have grown."""
        self.met = np.maximum(self.met, speeds)
        self._write()

    def _write(self) -> None:
        """Limits from the scales."""
        model, settings = self.model, self.model.settings
        extent, farthest, pace = (self.scales[name] for name in ("extent", "farthest", "pace"))
        numbers = np.finfo(model.precision.numpy)
        largest = float(numbers.max)  # infinity is beyond it
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            pace = np.fmax(pace, extent / settings.dt)
            far = np.fmax(self.resolved, 2.0 * farthest)[:, None]
            speed = np.sqrt(settings.energy_growth) * pace
            quick = np.fmax(GROWN * self.met, SLOW * pace)
        far = np.where(model.box_length > 0, largest, np.fmin(far, largest))
        values = {
            "lower": np.maximum(self.corners[0], -far),
            "upper": np.minimum(self.corners[1], far),
            "speed": np.fmin(speed, largest),
            "quick": np.fmin(quick, largest),
        }
        for name, value in values.items():
            self.arrays[name].assign(value.astype(model.precision.numpy))
        self.host = {name: array.numpy().copy() for name, array in self.arrays.items()}

    def wrong(self, x: np.ndarray, v: np.ndarray, world: np.ndarray) -> np.ndarray:
        """What is wrong with each particle: 0, FINITE, ESCAPED or FAST."""
        lower, upper, speed = (self.host[name][world] for name in ("lower", "upper", "speed"))
        finite = (np.isfinite(x) & np.isfinite(v)).all(axis=1)
        inside = ((x >= lower) & (x <= upper)).all(axis=1)
        slow = (np.abs(v) <= speed[:, None]).all(axis=1)
        return np.where(~finite, FINITE, np.where(~inside, ESCAPED, np.where(~slow, FAST, 0)))


def _corners(scenes: Iterable[Any], side: int) -> np.ndarray:
    """One corner of what each world's particles are to stay in; infinite where nothing is said."""
    nothing = np.full(3, np.inf if side else -np.inf)
    return np.stack([scene.bounds[side] if scene.bounds else nothing for scene in scenes])
