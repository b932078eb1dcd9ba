"""Trace: go through a failed frame once more, slowly, and see who did it, and whether with a cause.

Has an energy that has grown a cause, or is it an artefact of the step? What the laws of a scene do
does not depend on the substep. So the frame is done again with two and with four times the
substeps, and what the largest speeds of each world have gained in it is compared: it agrees where a
spring is let go, a charge falls or a user's force pushes, and differs where the step is past its
stability limit (each substep then multiplies the velocity, however little a frame) or where a force
was met for one substep that no finer path meets (the speed is then in proportion to the substep).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...engine.frames import Frames
from ...engine.loop import Loop, in_turn
from ...engine.observers import FOLLOW, FORCE, Observer
from .limits import FAST, FINITE, Limits

REFINEMENTS = (1, 2, 4)
AGREE = 2.0  # ratio of the energies that are gained in a frame
SHARE = 0.1  # of its velocity that a part must have added within the substep to have done it


@dataclass
class Culprit:
    """The first wrong particle of a world: row of the arrays, substep (from 0), part."""

    world: int
    kind: int
    row: int
    substep: int
    position: np.ndarray
    velocity: np.ndarray
    part: str | None = None


def survey(
    loop: Loop, limits: Limits, substep: int, kinds: dict[int, int] | None = None
) -> list[Culprit]:
    """The worlds that are wrong at present, each with its first, or fastest, wrong particle.

    Args:
        loop: What is in motion.
        limits: What it is to keep.
        substep: Which one has just ended.
        kinds: Look only at these worlds, and only for this; None: at all, for anything.
    """
    x, v, model = loop.get("position"), loop.get("velocity"), loop.model
    wrong = limits.wrong(x, v, model.world_of)
    found = []
    for w in np.unique(model.world_of[wrong > 0]).tolist() if kinds is None else kinds:
        begin, end = model.rows(w).start, model.rows(w).stop
        mine = wrong[begin:end]
        kind = int(mine[mine > 0].min(initial=FAST)) if kinds is None else kinds[w]
        hits = mine == kind
        if not hits.any():
            continue
        speed = np.where(hits, np.abs(v[begin:end]).max(axis=1), -1.0)
        row = begin + int(np.argmax(hits if kind == FINITE else speed))
        found.append(Culprit(w, kind, row, substep, x[row].copy(), v[row].copy()))
    return found


def trace(frames: Frames, limits: Limits, culprits: list[Culprit], substeps: int) -> list[Culprit]:
    """Who first did what is wrong at the end of a frame; leaves the state of its start.

    Args:
        frames: Of which one has failed.
        limits: What it was to keep.
        culprits: As surveyed at the end of the frame.
        substeps: Of the frame that failed.
    """
    loop, snapshot = frames.loop, frames.snapshot
    dt = loop.settings.dt / substeps
    found = {each.world: each for each in culprits}
    pending = {each.world: each.kind for each in culprits}
    snapshot.restore()
    for k in range(substeps):
        loop.substep(dt)
        for each in survey(loop, limits, k, pending):
            found[each.world] = each
            del pending[each.world]
        if not pending:
            break
    snapshot.restore()
    for k in range(1 + max(each.substep for each in found.values())):
        now = [each for each in found.values() if each.substep == k]
        if not now:
            loop.substep(dt)
            continue
        fused, loop.passes = loop.passes, in_turn(loop.interactions)  # one by one
        with loop.observers.watching(_Look(loop, now, dt)):
            loop.substep(dt)
        loop.passes = fused
    snapshot.restore()
    return [found[w] for w in sorted(found)]


class _Look(Observer):
    """Looks around every part of one substep at what it does to the worlds that fail in it.

    What is not finite is laid to the part after which it first is. What moves the particle without
    being infinite itself is laid to the part that adds most to its velocity.
    """

    def __init__(self, loop: Loop, pending: list[Culprit], dt: float):
        self.loop, self.dt, self.pending = loop, dt, pending
        self.open = {each.world: each for each in pending if each.kind == FINITE}
        self.pushes: list[dict[str, np.ndarray]] = [{} for _ in pending]

    def before(self, part: Any, stage: str) -> None:
        self._see(None, ("position", "velocity"))  # what the motion itself has done
        self.start = [self._push(each.row) for each in self.pending]

    def after(self, part: Any, stage: str) -> None:
        self._see(part.name, ("force",) if stage in (FORCE, FOLLOW) else ("position", "velocity"))
        with np.errstate(invalid="ignore", over="ignore"):
            for each, start, mine in zip(self.pending, self.start, self.pushes, strict=True):
                mine[part.name] = mine.get(part.name, 0.0) + self._push(each.row) - start

    def end(self, dt: float) -> None:
        for each, mine in zip(self.pending, self.pushes, strict=True):
            sizes = {name: _size(push) for name, push in mine.items()}
            most = max(sizes, key=lambda name: sizes[name], default=None)
            enough = 0.0 if each.kind == FINITE else SHARE * _size(each.velocity)
            if each.part is None and most and sizes[most] > enough:
                each.part = most

    def _push(self, row: int) -> np.ndarray:
        """The velocity of a particle with what its present force and correction will add."""
        state, dt = self.loop.state, self.dt
        u = state.velocity[row : row + 1].numpy()[0].astype(np.float64)
        if "force" in state:
            w = float(state.inverse_mass[row : row + 1].numpy()[0])
            u = u + state.force[row : row + 1].numpy()[0].astype(np.float64) * w * dt
        if "correction" in state:
            u = u + state.correction[row : row + 1].numpy()[0].astype(np.float64) / dt
        return u

    def _see(self, part: str | None, names: tuple[str, ...]) -> None:
        """Note the worlds in which something is no longer finite, and that ``part`` did it."""
        if not self.open:
            return
        arrays = [self.loop.get(name) for name in names]
        for w, culprit in list(self.open.items()):
            rows = self.loop.model.rows(w)
            if not all(np.isfinite(each[rows]).all() for each in arrays):
                del self.open[w]
                culprit.part = part


def _size(velocity: np.ndarray) -> float:
    """Of a velocity, from 0 to the largest number; what is no number counts as that."""
    largest = np.finfo(np.float64).max
    return float(
        np.nan_to_num(np.abs(velocity.astype(np.float64)), nan=largest, posinf=largest).max()
    )


def causes(frames: Frames, worlds: Iterable[int], substeps: int) -> dict[int, float]:
    """The largest speed of each of these worlds that has a cause; others are left out.

    Starts from the last good frame, and leaves the state of its end after ``substeps``.
    """
    peaks = []
    frames.snapshot.restore()
    speeds = np.abs(frames.loop.get("velocity").astype(np.float64)).max(axis=1)
    before = [_largest(speeds, frames.loop.model.rows(w)) for w in worlds]
    for refinement in REFINEMENTS:
        frames.snapshot.restore()
        peak = frames.peaks(refinement * substeps)
        peaks.append([_largest(peak, frames.loop.model.rows(w)) for w in worlds])
    frames.snapshot.restore()
    frames.run(substeps)
    return {
        w: float(max(speeds))
        for w, speeds, first in zip(worlds, np.transpose(peaks), before, strict=True)
        if np.isfinite(speeds).all() and _agree(speeds**2 - first**2)
    }


def _agree(gained: np.ndarray) -> bool:
    return bool(gained.min() > 0 and gained.max() <= AGREE * gained.min())


def _largest(peak: np.ndarray, rows: slice) -> float:
    mine = peak[rows]
    return float(mine.max()) if np.isfinite(mine).all() else np.inf
