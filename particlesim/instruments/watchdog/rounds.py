"""Rounds: what the watchdog looks at only now and then, and tells once of each world.

- Energy, where every force has a potential and nothing else acts: it may differ by ``DRIFT`` of
  itself at the start, or of the largest kinetic energy that a round has seen.
- Constraints: how far the particles of a tuple are off, |C + alpha F| / |grad C|, in
  parts of how far they are apart; how deep grains are in each other and in boundaries, in parts of
  their radius.
- The limits of the substep, at the present state.

What is found in two rounds that follow one another is told: a start from rest has no kinetic energy
to compare with yet, and one that does not fit its constraints eases.

A round takes as long as a thousand substeps of a small scene. It is made after 8, 16, 32 ...
frames, and from then on so seldom that it is under 2 % of the time, by a rule of the scene alone;
and whenever something has become half as fast again. Nothing of the motion depends on it.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from typing import Any

import numpy as np
import warp as wp

from ...constraints.boundaries.solid import SolidBoundary
from ...constraints.constraint import Constraint
from ...constraints.contact import Contact
from ...constraints.fluids.density import FluidDensity
from ...engine.loop import Loop
from ..diagnostics import measure, undisturbed
from ..residuals import UNMET, off, residuals
from ..stability import SAFETY, warn_if_past
from .incident import SimulationWarning
from .limits import GROWN, Limits

DRIFT = 0.1  # of the largest kinetic energy
DEEP = 0.2  # of a radius
THROUGH = 1.0  # radii: who is so deep is on its way through
DENSE = 0.1  # of the rest density
FIRST = 8  # frames: what is ahead of a start is looked at as a run begins
SHARE = 50  # times its own cost, from one round to the next
ROUND = 6e6  # what a round costs beside three evaluations of the forces, in pairs of these
SUBSTEP = 2e3  # and a substep beside one


class Rounds:
    """Of one loop.

    Args:
        loop: What is in motion.
        limits: Of its speeds, by which the watchdog calls for a round.
    """

    def __init__(self, loop: Loop, limits: Limits):
        self.loop, self.limits = loop, limits
        self.made, self.next = -1, 0  # frames
        self.kept = conserves(loop)
        worlds = loop.model.world_count
        self.start, self.fastest = np.full(worlds, np.nan), np.zeros(worlds)
        self.off = np.zeros(worlds, dtype=bool)  # in the last round
        self.told: set[tuple[Any, int]] = set()
        self.missed: set[tuple[int, int]] = set()  # constraints and worlds, in the last round
        self.met = np.zeros(2)  # the largest speed and acceleration, when limits were last asked

    def begin_anew(self, worlds: Iterable[int]) -> None:
        """These worlds were written from outside: their energy is another."""
        self.start[list(worlds)] = np.nan

    def due(self, hurried: bool) -> bool:
        """Whether it is time for a round; ``hurried``: something has become fast."""
        frame = self.loop.frame
        return frame >= self.next or frame < self.made or (hurried and frame >= FIRST)

    def make(self) -> None:
        """Look, tell, and say when to look again."""
        loop = self.loop
        with np.errstate(all="ignore"):
            if self.kept:
                self._energy()
            if loop.frame and loop.constraints:
                self._constraints()
        self._limits()
        self.made = loop.frame
        work, settings = loop.work, loop.settings
        most = SHARE * (ROUND + 3.0 * work) / (settings.substeps * (SUBSTEP + work))
        self.next = loop.frame + max(1, min(max(loop.frame, FIRST), int(most) + 1))

    def listen(self) -> None:
        """Tell of iterations that have ended before they were done, in any substep since."""
        settings = self.loop.settings
        for part in self.loop.interactions:
            for each in part.iterated():
                for w in np.nonzero(each.missed > 0)[0].tolist():
                    self._tell(
                        (id(part), each.what), w,
                        f"{part.name} must come to a {each.what} error of {each.tolerance:g} on "
                        f"average, got {each.missed[w]:.3g} after {settings.pressure_iterations} "
                        "iterations",
                        f"use more substeps than {settings.substeps}, or pressure_iterations",
                    )  # fmt: skip

    def _limits(self) -> None:
        """Asked again where the motion has become faster, or stronger; at the start by the run."""
        state, model = self.loop.state, self.loop.model
        speeds = np.zeros(model.world_count)
        np.maximum.at(speeds, model.world_of, _lengths(state.velocity))
        sizes = np.array([speeds.max(initial=0.0), 0.0])
        if "force" in state:
            sizes[1] = (_lengths(state.force) * state.inverse_mass.numpy()).max(initial=0.0)
        self.limits.meet(speeds)
        grown = (sizes > GROWN * self.met).any()
        self.met = np.maximum(self.met, sizes)
        if grown and self.loop.frame:
            warn_if_past(self.loop, again=True)

    def _energy(self) -> None:
        now = measure(self.loop)
        energy, fresh = now.energy, np.isnan(self.start)
        self.start[fresh] = energy[fresh]
        self.fastest[fresh] = 0.0
        self.fastest = np.fmax(self.fastest, now.kinetic)
        drift = np.abs(energy - self.start) / np.fmax(self.fastest, np.abs(self.start))
        off = drift > DRIFT
        for w in np.nonzero(off & self.off)[0].tolist():
            self._tell(
                "energy", w,
                f"energy must stay within {DRIFT:.0%} of itself or the largest kinetic energy, as "
                f"all forces have potentials, got {energy[w]:.6g} after {self.start[w]:.6g}, off "
                f"by {drift[w]:.2g} of it",
                self._finer()
                + ("" if self.loop.integrator.order > 1 else ", or integrator='velocity_verlet'"),
            )  # fmt: skip
        self.off = off

    def _finer(self) -> str:
        """What makes steps shorter."""
        settings = self.loop.settings
        if settings.adaptive:
            return f"use a safety below {settings.safety or SAFETY:g}"
        return f"use more substeps than {settings.substeps}"

    def _constraints(self) -> None:
        """Tell of what was missed in the last round, too, or is by more than a radius."""
        loop, missed = self.loop, set()
        with undisturbed(loop):
            loop.neighbors.update_for_constraints(loop.state)
            loop.neighbors.grow()
            for constraint in loop.constraints:
                for worst, world, what, most in _unmet(constraint, loop):
                    for w in np.unique(world[worst > most]).tolist():
                        missed.add((id(constraint), w))
                        size = worst[world == w].max()
                        within = most == DEEP and size > THROUGH
                        if within or (id(constraint), w) in self.missed:
                            must = f"{constraint.name} must hold within {most:.0%} of {what}"
                            remedy = "use more substeps or iterations, or see whether it can hold"
                            self._tell(id(constraint), w, f"{must}, got {size:.2g} of it", remedy)
        self.missed = missed

    def _tell(self, about: Any, w: int, must: str, remedy: str) -> None:
        if (about, w) in self.told:
            return
        self.told.add((about, w))
        where = f" in world {w}" if self.loop.model.world_count > 1 else ""
        warnings.warn(
            f"Simulation: {must}{where} at t = {self.loop.time:g}; {remedy}.",
            SimulationWarning, stacklevel=5,
        )  # fmt: skip


def _lengths(array: wp.array) -> np.ndarray:
    """Lengths of vectors, (n,)."""
    return np.linalg.norm(array.numpy().astype(np.float64), axis=1)


def conserves(loop: Loop) -> bool:
    """Whether nothing acts but forces that have a potential, which does not change in time."""
    return (
        bool(loop.interactions) and not loop.constraints and not loop.thermostats
        and all(each.conservative for each in loop.interactions)
    )  # fmt: skip


def _unmet(constraint: Any, loop: Loop) -> list[tuple[np.ndarray, np.ndarray, str, float]]:
    """By how much it is off, in parts of what that is said of; the worlds; that; and how much
    may be.
    """
    if isinstance(constraint, Constraint):
        found = off(constraint, loop)
        return [] if found is None else [(*found, "its particles' distance", UNMET)]
    if isinstance(constraint, FluidDensity) and constraint.count:
        error, world = constraint.errors(forgiven=True)
        return [(error, world, "its rest density", DENSE)]
    if not isinstance(constraint, Contact | SolidBoundary):
        return []
    missed = residuals(constraint, loop)
    if missed is None:
        return []
    depth, world = missed
    slack = constraint.easing.slack.numpy()  # what a start overlaps by is called in slowly
    if isinstance(constraint, SolidBoundary):
        rows = constraint.held.particle.numpy()
        depth = depth - slack.reshape(len(rows), -1).max(axis=1)
    else:
        rows = constraint.pairs.pairs.order.numpy()
        most = np.zeros(loop.model.world_count)
        np.maximum.at(most, world, slack[rows])
        depth = depth - slack[rows] - most[world]
    radius = loop.get("radius").astype(np.float64)[rows]
    return [(np.where(radius > 0, depth / radius, 0.0), world, "a radius", DEEP)]
