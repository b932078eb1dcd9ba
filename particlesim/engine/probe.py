"""Probe: asks the parts of a simulation how they react, and leaves no trace in it."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any, Self

import numpy as np
import warp as wp

from ..scene.part import Interaction
from .execution.acting import Attributes, act
from .limit import Limit
from .loop import Loop
from .model import Model
from .rates.rates import Rates, implicit_rates, turns
from .rates.spectrum import Largest, largest, size_of

STEPS, LEAST = 30, 4  # applications of a Jacobian
WORK = 2e7  # particles and pairs that forces are evaluated for
TOLERANCE = 0.005  # of an eigenvalue: half of that in the frequency
SAMPLE = 1024  # particles whose neighbours are looked for among as many others
CLUMPED = 0.01  # of the mean spacing: closer pairs count as overlapping
MEMORY = 4e7  # numbers to keep at most, for large scenes


class Probe:
    """What parts are given to find their limits with (``Interaction.limits``).

    Within the context the state may be written; at its end every array is as it was, bit for bit.
    Rows of neighbours are used as they are and never made anew.

    Args:
        loop: What is in motion, at any moment outside a step.
        quick: Rates that are surely within the settings' limits need not be exact.
        steps: Applications of a Jacobian at most, two evaluations of the force each; fewer where
            these would take long.
    """

    def __init__(self, loop: Loop, quick: bool = False, steps: int = STEPS):
        self.loop, self.model, self.state, self.quick = loop, loop.model, loop.state, quick
        self.steps = max(LEAST, min(steps, int(WORK / (2.0 * max(loop.work, 1.0)))))
        self.settings = loop.settings
        self.rates: list[tuple[Interaction, Rates]] = []  # of those asked

    def __enter__(self) -> Self:
        self._kept = {name: wp.clone(array) for name, array in self.state.arrays.items()}
        return self

    def __exit__(self, *error: Any) -> None:
        for name, array in self._kept.items():
            wp.copy(self.state.arrays[name], array)
        self._gather()
        del self._kept

    # What is there ----------------------------------------------------------------------------

    @functools.cached_property
    def position(self) -> np.ndarray:
        """(n, 3), float64."""
        return self._host("position")

    @functools.cached_property
    def velocity(self) -> np.ndarray:
        """(n, 3), float64."""
        return self._host("velocity")

    @functools.cached_property
    def inverse_mass(self) -> np.ndarray:
        """w = 1 / m, 0 for pinned particles, (n,)."""
        if "inverse_mass" in self.state:
            return self._host("inverse_mass")
        start = self.state.start("inverse_mass")
        assert start is not None
        return start

    @functools.cached_property
    def mass(self) -> np.ndarray:
        """Masses, of pinned particles too, (n,)."""
        if "mass" in self.state:
            return self._host("mass")
        return self.model.column("mass")

    @functools.cached_property
    def acceleration(self) -> np.ndarray:
        """By all interactions at the present state, (n, 3)."""
        if "force" not in self.state:
            return np.zeros_like(self.position)
        return self.force(self.loop.passes) * self.inverse_mass[:, None]

    @functools.cached_property
    def spacing(self) -> float:
        """About the distance of the closest particles [length]; above 0."""
        return _spacing(self.model, self.position, self.velocity, self.settings.substep)

    def relative_speed(self, rows: np.ndarray) -> np.ndarray:
        """Speeds of these particles in the frame of their world's mean velocity."""
        v, world = self.velocity[rows], self.model.world_of[rows]
        count = np.maximum(np.bincount(world, minlength=self.model.world_count), 1)
        mean = np.stack(
            [np.bincount(world, v[:, axis], self.model.world_count) for axis in range(3)], axis=1
        ) / count[:, None]  # fmt: skip
        return np.linalg.norm(v - mean[world], axis=1)

    def place(self, row: int) -> tuple[int, int]:
        """World and particle of a row of the state's arrays."""
        world = int(self.model.world_of[row])
        return world, int(row - self.model.offsets[world])

    # How parts react --------------------------------------------------------------------------

    def force(
        self,
        parts: Sequence[Interaction],
        position: np.ndarray | None = None,
        velocity: np.ndarray | None = None,
    ) -> np.ndarray:
        """Force of some interactions on every particle, (n, 3), float64; here or elsewhere."""
        for name, value in (("position", position), ("velocity", velocity)):
            if value is None:
                wp.copy(self.state[name], self._kept[name])
            else:
                self.state[name].assign(value.astype(self.model.precision.numpy))
        self._gather()
        self.state.clear_forces()
        for part in parts:
            own = Attributes(part)
            act(part, part.apply, self.state, self.loop.neighbors, self.settings.substep)
            own.restore()
        return self._host("force")

    def response(
        self, part: Interaction, most: tuple[float, float] = (np.inf, np.inf)
    ) -> list[Limit]:
        """The limit from the gradients of a part's force, by differences; none if it has none.

        omega^2 is the largest eigenvalue of -W^(1/2) (df/dx) W^(1/2), gamma that of the same with
        df/dv, W the inverse masses; ``most`` are upper bounds of both that the part knows. An
        eigenvalue of df/dv that is imaginary is a rotation: an explicit kick along the tangent
        gains energy at any step. What is implicit in the velocity is stable at any; from 2 / gamma
        on it turns velocities about.
        """
        return self.together([part], most)

    def together(
        self, parts: Sequence[Interaction], most: tuple[float, float] = (np.inf, np.inf)
    ) -> list[Limit]:
        """As :meth:`response`, of the sum of several parts."""
        if "force" not in self.state or not self._mobile.any():
            return []
        frequency = self._largest(parts, "position")
        damping = self._largest([each for each in parts if each.reads_velocity], "velocity")
        implicit = self._largest([each for each in parts if each.implicit], "velocity")
        damped, turned = implicit_rates(implicit, self.loop.integrator.damps)
        rates = Rates(
            min(frequency.bound, most[0]), min(damping.bound, most[1]) + damped, turned,
            turn=turns(damping), turns=turns(implicit) > 0.0,
        )  # fmt: skip
        if rates.none:
            return []
        if len(parts) == 1:
            self.rates.append((parts[0], rates))
        name = " + ".join(part.name for part in parts)
        kind, dt, reason = rates.tightest(self.loop.integrator)
        found = {"frequency": frequency, "force": frequency}.get(kind, damping)
        if not len(found.vector):
            found = implicit if len(implicit.vector) else frequency
        return [Limit(name, kind, dt, reason, *self._peak(found))]

    def damping(self, part: Interaction) -> float:
        """gamma alone, the largest rate at which a part's force answers to velocities [1/time]."""
        return self._largest([part], "velocity").bound

    def _peak(self, found: Largest) -> tuple[int, int]:
        """World and particle where an eigenvector is largest."""
        row = int(np.argmax((found.vector.reshape(-1, 3) ** 2).sum(axis=1)))
        return self.place(int(np.nonzero(self._mobile)[0][row]))

    def _largest(self, parts: Sequence[Interaction], what: str) -> Largest:
        """The largest eigenvalue of the Jacobian with respect to position or velocity."""
        if not parts:
            return Largest(0.0, 0.0, np.zeros(0), 0)
        apply = self._operator(parts, what)
        rng = np.random.default_rng(0)
        start = rng.normal(size=3 * int(self._mobile.sum()))
        steps = max(LEAST, min(self.steps, int(MEMORY / (2 * len(start)))))
        enough = 0.0
        if self.quick:
            dt = self.settings.substep
            enough = 4.0 / dt**2 if what == "position" else 2.0 / dt
        return largest(apply, start, steps=steps, tolerance=TOLERANCE, enough=enough)

    def _operator(
        self, parts: Sequence[Interaction], what: str
    ) -> Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]:
        """-W^(1/2) J W^(1/2) on the mobile particles, by central differences."""
        mobile, real = self._mobile, self.model.precision.numpy
        root = np.sqrt(self.inverse_mass[mobile])[:, None]
        at = self.position if what == "position" else self.velocity
        # The cube root balances the error of a central difference and the rounding of the force.
        size = self.spacing if what == "position" else self._speed
        step = max(np.cbrt(np.finfo(real).eps) * size, 8 * np.spacing(np.abs(at).max(), dtype=real))

        def apply(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            moved = np.zeros_like(at)
            moved[mobile] = root * q.reshape(-1, 3)
            moved *= step / max(np.linalg.norm(moved, axis=1).max(), 1e-300)
            ahead, behind = ((at + way * moved).astype(real).astype(float) for way in (1, -1))
            with np.errstate(invalid="ignore", over="ignore"):  # not finite: told as such
                gain = self.force(parts, **{what: ahead}) - self.force(parts, **{what: behind})
            done = (ahead - behind)[mobile] / root
            twice = 2.0 * size_of(done) or 1.0
            return 2.0 * done.ravel() / twice, (-2.0 / twice * root * gain[mobile]).ravel()

        return apply

    @functools.cached_property
    def _mobile(self) -> np.ndarray:
        return self.inverse_mass > 0

    @property
    def _speed(self) -> float:
        """A typical speed, for differences; where nothing moves, a slow one."""
        fastest = float(np.linalg.norm(self.velocity, axis=1).max(initial=0.0))
        return fastest or 1e-3 * self.spacing / self.settings.substep

    def _host(self, name: str) -> np.ndarray:
        return self.state[name].numpy().astype(np.float64)

    def _gather(self) -> None:
        """Copy what the loops read into the order of their rows."""
        for each in self.loop.neighbors.lists:
            each.gather(self.state, each.names)


def _spacing(model: Model, x: np.ndarray, v: np.ndarray, dt: float) -> float:
    """About the distance of the closest particles of a world [length], above 0.

    Looks along each axis at the next few in order, so it may miss the very closest, not the scale.
    Where particles are alone: their radius, how far from the origin they are, or how fast.
    """
    closest = [
        each
        for w in range(model.world_count)
        if (each := _spacing_of_world(x[slice(*model.offsets[w : w + 2])])) is not None
    ]
    if closest:
        return min(closest)
    fastest = float(np.abs(v).max(initial=0.0))
    candidates = (
        float(model.column("radius").max(initial=0.0)),
        float(np.abs(x).max(initial=0.0)),
        fastest * dt,
    )
    return next((each for each in candidates if each > 0), 1.0)


def _spacing_of_world(x: np.ndarray) -> float | None:
    if len(x) < 2:
        return None
    extent = np.ptp(x, axis=0)
    extent = extent[extent > 1e-9 * extent.max()]
    if not len(extent):
        return None
    mean = float(np.exp(np.log(extent).mean()) / (len(x) ** (1 / len(extent)) - 1 + 1e-9))
    d = _neighbor_distances(x)
    d = d[d > CLUMPED * min(mean, float(extent.max()))]
    return float(d.min(initial=mean))


def _neighbor_distances(x: np.ndarray) -> np.ndarray:
    """Distances of pairs among which close ones are: all, or those next to each other in order."""
    if len(x) <= SAMPLE:
        i, j = np.triu_indices(len(x), 1)
        return np.linalg.norm(x[i] - x[j], axis=1)
    lower, extent = x.min(axis=0), np.ptp(x, axis=0)
    width = max(float(extent.max()), 1e-300) / max(1.0, len(x) ** (1 / 3))
    cell = np.floor((x - lower) / width).astype(np.int64)
    ordered = x[np.lexsort(cell.T)]
    lags = [np.linalg.norm(ordered[lag:] - ordered[:-lag], axis=1) for lag in range(1, 9)]
    return np.concatenate(lags)
