"""Foresight: the limits on the path ahead, along which forces stiffen, turn on and pull faster.

The simulation goes on for a while, by steps that follow how fast its forces change, and is put back
as it was, bit for bit. Wherever the motion is faster, or the force stiffer or stronger, than where
they were last asked, the limits are asked again. No unit of time is assumed: steps double while
nothing changes, and are taken back where they have gone too far.

On the way goes along what the integrator's modified energy differs from the energy by: it is that
which the method conserves, and not the energy (Hairer, Lubich and Wanner 2006, IX.3). For a step h

    symplectic Euler    h / 2  F.v
    velocity Verlet     -h^2 (v.dF/dt / 12 + F.w F / 24), also as a stage of another method
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..engine.execution.acting import Attributes
from ..engine.limit import Limit
from ..engine.loop import Loop
from ..engine.probe import Probe
from ..engine.snapshot import Snapshot
from .diagnostics import measure

STEPS = 240  # of the path, at most
WORK = 1e7  # particles and pairs that forces are evaluated for, some 0.3 s on one core
LOOK = 8  # applications of a Jacobian where the limits are asked on the way
FEW = 12  # evaluations: with fewer there is no path
PHASE = 0.5  # omega h of a step on the path
TOO_FAR = 0.8  # of it: what is taken back, too
QUIET = 40  # steps on which no force changes, each twice as long as the last: nothing comes
TRIES = 12  # of a step that goes too far
SINGULAR = 1e-9  # of the longest step before it
GROWN = 1.2  # times what was met before: the limits are asked again
ASKED = 40  # times, at most
FAINT = 0.1  # of the rms displacement: what moves less says nothing about stiffness
STIFFER = 0.9  # of the limit now: what is above says nothing new
PAST = 0.65  # of a limit ahead: a step that ends past the turning point meets a stiffer force still


@dataclass(frozen=True)
class Ahead:
    """What was found on the path: the tightest limit, and the step that keeps the energy.

    ``energy_step``: the largest step by which the energy of every world stays within ``KEPT`` of
    its scale, as far as the path goes; infinite where constraints leave it no meaning.
    ``singular``: the path runs into a point, as of two bodies that fall straight on each other,
    where the force grows beyond all bounds: no step is small enough, and no limit is told.
    """

    limit: Limit | None
    energy_step: float
    singular: bool = False


KEPT = 0.08  # of an energy, by "auto": a tenth, less what higher orders add
LEAST = 0.001  # of the largest kinetic energy: what an energy near zero counts as


@np.errstate(all="ignore")
def look_ahead(loop: Loop, limits: list[Limit], share: float = 1.0) -> Ahead:
    """The path ahead of the present state, at which ``limits`` hold.

    Args:
        loop: What is in motion.
        limits: Of the present.
        share: Of the whole path: how far to look.
    """
    work = loop.work
    if any(part.answers for part in loop.interactions):
        return Ahead(None, math.inf)  # a force that is that of a whole step has no stiffness
    if not 0 < FEW * work <= WORK or not np.isfinite(loop.get("velocity")).all():
        return Ahead(None, math.inf)
    own, unknown = [Attributes(each) for each in loop.actors], set(loop.unknown_forces)
    with Probe(loop):  # puts back what the snapshot leaves out
        start = Snapshot(loop)
        try:
            return _Path(loop, limits, share * WORK / work).walk(int(share * STEPS))
        finally:
            start.restore()
            for each in own:
                each.restore()
            loop.unknown_forces = unknown


class _Path:
    """One walk along the path; leaves the state of its end."""

    def __init__(self, loop: Loop, limits: list[Limit], budget: float):
        self.loop, self.budget = loop, budget  # evaluations of the forces that are left
        self.first = _tightest(limits)
        names = {part.name for part in loop.constraints}
        self.crossing = _tightest([each for each in limits if each.part in names])
        self.found: Limit | None = None  # the tightest on the way
        self.when = 0.0
        self.trail: list[float] = []  # its steps
        self.asked, self.met = 0, np.zeros(3)
        self.moves = loop.model.column("pinned") == 0
        self.mass = loop.model.column("mass")
        self.energies = _Energies(loop, self.mass * self.moves)

    def walk(self, steps: int) -> Ahead:
        loop, t, quiet = self.loop, 0.0, 0
        self._settle()
        self.met = self._sizes(0.0)
        mark, h = Snapshot(loop), self._start()
        for _ in range(steps):
            if self.budget <= 0.0:
                break
            mark.take()
            before = self.x, self.v, self.a
            stiffness, h = self._step(mark, before, h)
            if not h > 0.0:
                break
            t += h
            quiet = 0 if stiffness > 0 else quiet + 1
            if quiet > QUIET:
                break
            self.trail.append(h)
            self.energies.note(h, self.v, before[2], self.a)
            sizes = self._sizes(stiffness)
            if (sizes > GROWN * self.met).any() and self.asked < ASKED and self.budget > 2 * LOOK:
                self.met = np.maximum(self.met, sizes)
                self._ask(t)
            pace = TOO_FAR * PHASE / math.sqrt(stiffness) if stiffness > 0 else math.inf
            h = min(2.0 * h, pace, PHASE * self.crossing)
        if self._singular():
            return Ahead(None, math.inf, singular=True)
        # Stages that are longer than the step ask for a shorter one.
        kept = self.energies.step(loop.integrator.order) / loop.integrator.reach()
        return Ahead(self._told(), kept)

    def _singular(self) -> bool:
        """Whether steps have shrunk, from the longest before, by more than any orbit asks for."""
        if not self.trail:
            return False
        steps = np.array(self.trail)
        return bool((steps < SINGULAR * np.maximum.accumulate(steps)).any())

    def _told(self) -> Limit | None:
        found = self.found
        if found is None:
            return None
        share = PAST if "frequency" in found.kind else 1.0
        reason = f"{share:g} of it in {self.when:.3g} s: {found.reason}"
        return replace(found, dt=share * found.dt, kind=f"{found.kind} ahead", reason=reason)

    def _start(self) -> float:
        """A step that is surely small: a part of what is known, in the scene's own unit of time."""
        speed, acceleration = self.met[1], self.met[2]
        length = max(float(np.ptp(self.x, axis=0).max()), float(np.abs(self.x).max()))
        known = [self.first]
        known += [length / speed] if speed > 0 and length > 0 else []
        known += [math.sqrt(length / acceleration)] if acceleration > 0 and length > 0 else []
        shortest = min(known)
        return 1e-3 * (shortest if 0.0 < shortest < math.inf else self.loop.settings.substep)

    def _step(
        self, mark: Snapshot, before: tuple[np.ndarray, ...], h: float
    ) -> tuple[float, float]:
        """Go on by about h: how stiff the force was on the way, and the step taken; 0: none."""
        for attempt in range(TRIES):
            with np.errstate(all="ignore"):
                self.budget -= 1.0
                self.loop.substep(h)
                if self.loop.neighbors.overflowing:  # rows are the run's own to lengthen
                    mark.restore()
                    return 0.0, 0.0
                self._settle()
                stiffness = self._stiffness(*before)
            if not np.isfinite(stiffness):
                factor = 0.1
            elif h * h * stiffness <= PHASE**2 or attempt == TRIES - 1:
                return stiffness, h
            else:
                factor = max(0.1, TOO_FAR * PHASE / (h * math.sqrt(stiffness)))
            mark.restore()
            self.x, self.v, self.a = before
            h *= factor
        return 0.0, 0.0

    def _settle(self) -> None:
        """Read positions and velocities, and the accelerations there."""
        loop = self.loop
        if "force" in loop.state:
            if loop.integrator.carries_forces:
                loop.know_forces()
            else:
                self.budget -= 1.0
                loop.forces(loop.settings.substep)
        self.x, self.v = (
            loop.state[name].numpy().astype(float) for name in ("position", "velocity")
        )
        if "image" in loop.state:
            self.x = loop.state.unwrapped()
        self.a = np.zeros_like(self.x)
        if "force" in loop.state:
            self.a = loop.state.force.numpy() * loop.state.inverse_mass.numpy()[:, None]
            self.a = self.a.astype(float)

    def _stiffness(self, x: np.ndarray, v: np.ndarray, a: np.ndarray) -> float:
        """The largest |change of acceleration| over |displacement| of a particle [1/time^2]."""
        moved = np.linalg.norm(self.x - x, axis=1)
        changed = np.linalg.norm(self.a - a, axis=1)
        if not np.isfinite(moved + changed).all():
            return math.inf
        least = FAINT * float(np.sqrt((moved**2).mean()))
        known = self.moves & (moved > 0)
        return float((changed[known] / np.maximum(moved[known], least)).max(initial=0.0))

    def _sizes(self, stiffness: float) -> np.ndarray:
        """How stiff, how fast and how strong."""
        speeds, pushes = (np.linalg.norm(each, axis=1) for each in (self.v, self.a))
        return np.array([stiffness, speeds.max(initial=0.0), pushes.max(initial=0.0)])

    def _ask(self, t: float) -> None:
        """The limits here: of all forces together, and of what depends on speed."""
        loop = self.loop
        self.asked += 1
        self.budget -= 2 * LOOK
        with Probe(loop, steps=LOOK) as probe:
            limits = [each for part in loop.constraints for each in part.limits(probe)]
            self.crossing = _tightest(limits)
            limits += probe.together(list(loop.interactions))
        tightest = min(limits, key=lambda each: each.dt, default=None)
        if tightest is None or not 0.0 < tightest.dt < STIFFER * self.first:
            return
        if self.found is None or tightest.dt < self.found.dt:
            self.found = tightest
            self.when = t


def _tightest(limits: list[Limit]) -> float:
    return min((each.dt for each in limits), default=math.inf)


class _Energies:
    """What the modified energy differs by from the energy, along a path, by worlds."""

    def __init__(self, loop: Loop, mass: np.ndarray):
        self.loop, self.mass = loop, mass
        self.kept = not loop.constraints and "force" in loop.state
        self.power: list[np.ndarray] = []
        self.second: list[np.ndarray] = []
        self.kinetic: list[np.ndarray] = []
        self.total = np.abs(measure(loop).energy) if self.kept else np.zeros(0)

    def note(self, h: float, v: np.ndarray, before: np.ndarray, a: np.ndarray) -> None:
        """A step of h has ended at v and a."""
        if not self.kept:
            return
        F = self.mass[:, None] * a
        change = self.mass[:, None] * (a - before) / h
        self.power.append(self._sum((F * v).sum(axis=1)))
        self.second.append(self._sum((v * change).sum(axis=1) / 12.0 + (F * a).sum(axis=1) / 24.0))
        self.kinetic.append(self._sum(0.5 * self.mass * (v**2).sum(axis=1)))

    def _sum(self, values: np.ndarray) -> np.ndarray:
        model = self.loop.model
        return np.bincount(model.world_of, values, model.world_count)

    def step(self, order: int) -> float:
        """The largest step by which every world's energy stays near what it is."""
        if not self.kept or not self.kinetic:
            return math.inf
        differs = np.array(self.power if order < 2 else self.second)
        off = np.abs(differs - differs[0]).max(axis=0) * (0.5 if order < 2 else 1.0)
        most = np.array(self.kinetic).max(axis=0)
        scale = np.minimum(most, np.maximum(self.total, LEAST * most))
        with np.errstate(divide="ignore", invalid="ignore"):
            most = KEPT * scale / off
        most = most[(off > 0) & np.isfinite(most)]
        return float(most.min(initial=math.inf)) ** (1.0 if order < 2 else 0.5)
