"""Stability of a simulation: asked for, warned of, and obeyed."""

from __future__ import annotations

import math
import warnings
import weakref
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import validate
from ..constraints.constraint import Constraint
from ..engine.limit import Limit
from ..engine.loop import Loop
from ..engine.probe import STEPS, Probe
from ..engine.rates.rates import Rates
from ..engine.report import Report, grid
from ..interactions.fusion import fuse
from ..scene.scene import Scene
from ..scene.settings import AUTO, Settings
from .foresight import Ahead, look_ahead
from .residuals import UNMET, off


@dataclass(frozen=True, repr=False)
class Stability(Report):
    """The limits of a simulation at one moment, the tightest first. ``str()`` makes a table.

    Args:
        limits: Of all parts.
        settings: What they are to be compared with.
    """

    limits: Sequence[Limit]
    settings: Settings

    @property
    def binding(self) -> Limit | None:
        """The tightest limit; None where nothing limits the substep."""
        first = self.limits[0] if self.limits else None
        return first if first is not None and first.dt < math.inf else None

    @property
    def dt(self) -> float:
        """Largest safe substep [s]; infinite where nothing limits it."""
        return math.inf if self.binding is None else self.binding.dt

    @property
    def substeps(self) -> float:
        """Substeps that a frame of ``settings.dt`` needs, a whole number; inf: no number does."""
        if self.dt <= 0.0:
            return math.inf
        return max(1, math.ceil(self.settings.dt / self.dt * (1.0 - 1e-9)))

    @property
    def safe(self) -> bool:
        """Whether the settings are within the limit."""
        return self.settings.substeps >= self.substeps

    def __str__(self) -> str:
        return "\n".join([self._heading(), "", *self._table()])

    def _heading(self) -> str:
        settings = self.settings
        now = f"substep of {settings.substep:.4g} s ({settings.substeps} of {settings.dt:.4g} s)"
        if self.binding is None:
            return f"{now}: nothing limits it"
        verdict = "within the limit" if self.safe else "PAST THE LIMIT"
        return (
            f"{now}: {verdict} of {self.dt:.4g} s, set by {self.binding.part} "
            f"({self.binding.kind}); a frame needs {self.substeps} substeps"
        )

    def _table(self) -> list[str]:
        names = ("part", "limit", "substep", "where", "why")
        heads = [(name, "right" if name == "substep" else "left") for name in names]
        steps = ["any" if math.isinf(each.dt) else f"{each.dt:.4g} s" for each in self.limits]
        return grid(
            heads,
            [
                (each.part, each.kind, step, each.where, each.reason)
                for each, step in zip(self.limits, steps, strict=True)
            ],
        )


PROVISIONAL = 1.0 / 60.0  # a frame's time while it is yet to be found
MANY = 10.0  # times the speed that anything has, or gains in a frame
FEW = 1e-4  # of the size of the scene: what rounding and stretched springs may be off
GLANCE = 0.4  # of the path ahead: what a run looks at before it begins
DEAREST = 0.0015  # of the limit: what an energy may ask for, at most; such a one is all but zero
SAFETY = 0.5  # of the limit, at most, where the settings leave it open
NEGLIGIBLE = 0.97  # of the tightest limit: what several parts do together matters below it

_checked: weakref.WeakSet[Loop] = weakref.WeakSet()
_warned: weakref.WeakSet[Loop] = weakref.WeakSet()


class StabilityWarning(UserWarning):
    """Settings are past the limit of a scene."""


def stability(loop: Loop, share: float = 1.0) -> Stability:
    """The limits of all parts now and on the path ahead (see ``Simulation.stability``).

    ``share``: of that path, how far to look.
    """
    return Stability(_in_order(_foreseen(loop, share)[0]), loop.settings)


def _foreseen(loop: Loop, share: float = 1.0) -> tuple[list[Limit], Ahead]:
    """The limits now and ahead, and what else there is on that path."""
    limits = limits_now(loop)
    ahead = look_ahead(loop, limits, share)
    return limits + ([] if ahead.limit is None else [ahead.limit]), ahead


def _in_order(limits: list[Limit]) -> list[Limit]:
    return sorted(limits, key=lambda limit: limit.dt)


@np.errstate(all="ignore")
def limits_now(loop: Loop, quick: bool = False, steps: int = STEPS) -> list[Limit]:
    """Those of the present; ``quick``: what the settings surely keep may be smaller than it is.

    ``steps``: as of :class:`~particlesim.engine.probe.Probe`.
    """
    limits: list[Limit] = []
    if loop.model.particle_count:
        with Probe(loop, quick, steps) as probe:
            for part in [*loop.interactions, *loop.constraints]:
                limits += part.limits(probe)
            limits += _together(probe, limits)
    return limits


def _together(probe: Probe, limits: list[Limit]) -> list[Limit]:
    """Several forces on the same particles are stiffer than each: their sum, if it matters.

    The largest eigenvalue of a sum is at most the sum of the largest eigenvalues, so often there
    is nothing to ask.
    """
    parts = [part for part, _ in probe.rates]
    bound = sum((rates for _, rates in probe.rates), Rates()).tightest(probe.loop.integrator)[1]
    tightest = min((limit.dt for limit in limits), default=math.inf)
    if len(parts) < 2 or bound > NEGLIGIBLE * tightest:
        return []
    return probe.together(parts)


def warn_if_past(loop: Loop, again: bool = False) -> None:
    """Warn, once a simulation, if its settings are past the limit, or its start does not fit.

    Args:
        loop: What is in motion.
        again: It has become faster: only the limits, where nothing was said of them.
    """
    if not loop.settings.dt > 0 or (loop in _warned if again else loop in _checked):
        return
    if not again:
        _checked.add(loop)
        for said in (misfit(loop), *(part.complaint() for part in loop.parts)):
            if said:
                warnings.warn(said, StabilityWarning, stacklevel=3)
    if loop.settings.adaptive:  # whose pace tells
        return
    report = Stability(_in_order(limits_now(loop, quick=True)), loop.settings)
    if not report.safe or not again:
        report = stability(loop, GLANCE)
    if again:  # what slow collisions gain is told by the energy, and is no danger
        limits = [each for each in report.limits if each.kind != "collision"]
        report = Stability(limits, loop.settings)
    if report.safe or report.binding is None:
        return
    _warned.add(loop)
    limit = report.binding
    remedy = "look at what pushes it"
    if math.isfinite(report.substeps):
        remedy = f"use Settings(substeps={report.substeps}) or more"
    warnings.warn(
        f"Simulation: substep must be at most {limit.dt:.3g} s for {limit.part} ({limit.kind}: "
        f"{limit.reason}{', ' * bool(limit.where)}{limit.where}), got "
        f"{loop.settings.substep:.3g} s; {remedy}.",
        StabilityWarning,
        stacklevel=3,
    )


def automatic(scenes: Sequence[Scene], settings: Settings, device: Any) -> Settings:
    """The settings with dt or substeps chosen by the limits of the start and of the path ahead.

    Raises:
        ValueError: Nothing limits the substep, or nothing is small enough.
    """
    of_frame = settings.dt == AUTO
    name = "dt" if of_frame else "substeps"
    trial = settings.replace(dt=PROVISIONAL) if of_frame else settings.replace(substeps=1)
    limit = _chosen(Loop(scenes, trial, device, fuse), settings.safety)
    if not 0.0 < limit < math.inf:
        what = "no part limits it" if limit > 0.0 else "the forces are not finite at the start"
        if math.isnan(limit):
            what = "particles fall into a point, which no step is small enough for"
        raise validate.fail(
            "Settings", name, f"be a number in a scene where {what}", AUTO, "give one"
        )
    if of_frame:
        return settings.replace(dt=settings.substeps * limit)
    return settings.replace(substeps=max(1, math.ceil(settings.dt / limit * (1.0 - 1e-9))))


def _chosen(loop: Loop, safety: float | None) -> float:
    """The substep that ``"auto"`` takes: a part of the limit, or what the energy asks for, too.

    Not a number where the path ahead is singular.
    """
    limits, ahead = _foreseen(loop)
    if ahead.singular:
        return math.nan
    largest = min((each.dt for each in limits), default=math.inf)
    if safety is not None:
        return safety * largest
    wanted = max(ahead.energy_step, DEAREST * largest)
    return min(SAFETY * largest, wanted) if largest < math.inf else math.inf


def misfit(loop: Loop) -> str:
    """What is to be said of a start that violates constraints of tuples; empty if nothing is.

    A correction dx of the first substep becomes the speed dx / dt, the larger the finer the
    substep. It is said of the particle that gets most, if that is more than ten times what moves
    in the scene anyway. (Contacts and boundaries bring in what overlaps at a bounded speed.)
    """
    parts = [part for part in loop.constraints if isinstance(part, Constraint) and part.count]
    dt = loop.settings.substep
    if not parts or not dt > 0:
        return ""
    with Probe(loop) as probe:
        x, v, a = probe.position, probe.velocity, probe.acceleration
        usual = np.linalg.norm(v, axis=1).max() + loop.settings.dt * np.linalg.norm(a, axis=1).max()
        size = np.ptp(x, axis=0).max()
        for part in parts:
            part.begin(loop.state, loop.neighbors, dt)
            part.project(loop.state, loop.neighbors, dt)
            moved = np.linalg.norm(loop.get("position").astype(np.float64) - x, axis=1)
            row = int(np.argmax(moved))
            if moved[row] > FEW * size and moved[row] > MANY * usual * dt:
                world, particle = probe.place(row)
                where = f"particle {particle}" + (f" in world {world}" if world else "")
                return (
                    f"Simulation: the start must fit {part.name}, got {where} moved by "
                    f"{moved[row]:.3g} in the first substep, which gives it {moved[row] / dt:.3g} "
                    "length/s; call sim.project(iterations) first, or place it better."
                )
    return next((said for part in parts if (said := _held_apart(loop, part))), "")


def _held_apart(loop: Loop, part: Constraint) -> str:
    """That a tuple of pinned particles is not met, and never will be; empty if none is."""
    pinned = loop.model.column("pinned")[part.tuples.particles] > 0
    found = off(part, loop) if pinned.all(axis=1).any() else None
    if found is None or not (unmet := pinned.all(axis=1) & (found[0] > UNMET)).any():
        return ""
    k = int(np.argmax(unmet))
    size, rows = f"{found[0][k]:.2g}", part.tuples.particles[k].tolist()
    return (
        f"Simulation: pins must fit {part.name} within {UNMET:.0%} of its particles' distance, got "
        f"{size} of it for particles {rows}; place them so, or leave the constraint out."
    )
