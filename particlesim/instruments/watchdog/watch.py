"""Watchdog: finds what goes wrong within a frame, and does what the settings say about it.

On the device it is one launch a frame, which compares every particle with the limits of its world
(see :mod:`.limits`) and raises a flag; the host reads the flag between frames. All else
happens only when it is up.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from typing import Any

import numpy as np
import warp as wp

from ...engine.blocks import blocks
from ...engine.execution.launch import launch, owner
from ...engine.frames import Frames
from ...engine.loop import Loop
from ...engine.model import Model
from ...engine.neighbors.lists import Neighbors
from ...engine.state import State
from ...kernels.instruments.watchdog import check_kernel, hold_kernel
from ...scene.settings import Settings
from .incident import Incident, SimulationError, SimulationWarning
from .limits import ESCAPED, FAST, FINITE, Limits
from .trace import Culprit, causes, survey, trace

KINDS = {FINITE: "not finite", ESCAPED: "escaped", FAST: "runaway"}
BLOCK_CPU, BLOCK_CUDA = 256, 8  # particles that a thread looks at
SHOWN = ("density", "pressure")  # made anew in every substep, and shown to users


class Watchdog:
    """Looks at every particle once a frame.

    ``flag`` is two ints on the device, something is wrong and something is quicker than when it was
    looked at; ``frozen`` holds the worlds that stand still.
    """

    def __init__(self, model: Model, neighbors: Neighbors):
        self.model = model
        self.limits = Limits(model, neighbors)
        self.flag = wp.zeros(2, dtype=wp.int32, device=model.device)
        # On the CPU the flag is the memory itself: a look needs no copy.
        self._seen = self.flag.numpy() if model.device.is_cpu else None
        size = BLOCK_CPU if model.device.is_cpu else BLOCK_CUDA
        edges = blocks(model.offsets, size)
        self._blocks = [model.array(each, wp.int32) for each in edges]
        self.frozen: set[int] = set()
        self.incidents: list[Incident] = []  # what was found, and done about it
        self._mark = wp.zeros(model.world_count, dtype=wp.int32, device=model.device)
        self._held: list[tuple[wp.array, wp.array, wp.array]] = []  # worlds of rows, copy, array

    @property
    def settings(self) -> Settings:
        """As they are at present."""
        return self.model.settings

    # On the device ----------------------------------------------------------------------------

    def look(self, state: State) -> None:
        """At the end of a frame: put frozen worlds back, and look at all particles. Launches."""
        with owner("watchdog"):
            for world, copy, array in self._held:
                inputs = [world, self._mark, copy, array]
                launch(hold_kernel(array.dtype), len(array), inputs, array.device)
            if self.settings.watchdog:
                launch(
                    check_kernel(self.model.precision, self.model.vectorised),
                    len(self._blocks[0]),
                    [*self._blocks, *self.limits.arrays.values(), state.position,
                     state.velocity, self.flag],
                    self.model.device,
                )  # fmt: skip

    @property
    def alarmed(self) -> bool:
        """Something was wrong at the end of the frame."""
        seen = self.flag.numpy() if self._seen is None else self._seen
        return bool(seen[0])

    @property
    def hurried(self) -> bool:
        """Something was quicker than the limits of the substep were last asked for."""
        seen = self.flag.numpy() if self._seen is None else self._seen
        return bool(seen[1])

    def forget(self) -> None:
        """What was seen is void: the frame is done again."""
        self.flag.zero_()

    # On the host ------------------------------------------------------------------------------

    def attend(self, frames: Frames) -> None:
        """The flag is up: find out why, and act.

        Raises:
            SimulationError: ``on_failure`` is ``"stop"``, or no retry has helped.
        """
        substeps = self.settings.substeps
        culprits = self._wrong(frames, substeps)
        if culprits:
            culprits = trace(frames, self.limits, culprits, substeps)
            act = {"stop": self._stop, "retry": self._retry, "freeze": self._freeze}
            try:
                act[self.settings.on_failure](frames, culprits)
            finally:
                frames.close(but=substeps)  # the threads of finer frames go home
        self.flag.zero_()

    def _wrong(self, frames: Frames, substeps: int) -> list[Culprit]:
        """Worlds that are wrong at the end of a frame of so many substeps, without a cause."""
        self.flag.zero_()
        culprits = survey(frames.loop, self.limits, substeps - 1)
        fast = [each.world for each in culprits if each.kind == FAST]
        if fast:
            allowed = causes(frames, fast, substeps)
            self.limits.allow(allowed)
            self.flag.zero_()
            culprits = [each for each in culprits if each.world not in allowed]
        return culprits

    def _incident(self, loop: Loop, culprit: Culprit, action: str, substeps: int) -> Incident:
        row, kind, start = culprit.row, culprit.kind, loop.time
        return Incident(
            kind=KINDS[kind],
            world=culprit.world,
            particle=row - int(self.model.offsets[culprit.world]),
            frame=loop.frame,
            start=start,
            stop=start + self.settings.dt,
            substep=culprit.substep + 1,
            of=self.settings.substeps,
            part=culprit.part,
            position=_triple(culprit.position),
            velocity=_triple(culprit.velocity),
            limit=self._limit(loop, culprit),
            action=action,
            substeps=substeps,
        )

    def _limit(self, loop: Loop, culprit: Culprit) -> str:
        host, w = self.limits.host, culprit.world
        if culprit.kind == FINITE:
            return next((each.fault(w) for each in loop.parts if each.name == culprit.part), "")
        if culprit.kind == ESCAPED:
            lower, upper = (np.array2string(host[name][w]) for name in ("lower", "upper"))
            return f"{lower} to {upper}"
        return f"{host['speed'][w]:g}" if culprit.kind == FAST else ""

    def _stop(self, frames: Frames, culprits: list[Culprit], substeps: int | None = None) -> None:
        """Raise, from the last good frame; ``substeps``: which did not help either."""
        frames.snapshot.restore()
        self.flag.zero_()
        incidents = [
            self._incident(frames.loop, each, "stop", substeps or self.settings.substeps)
            for each in culprits
        ]
        self.incidents += incidents
        text = incidents[0].found
        if substeps:
            text += f"; even {substeps} substeps do not help"
        if len(incidents) > 1:
            worlds = [str(each.world) for each in incidents[1:]]
            text += f"; and worlds {', '.join(worlds[:4])}{', ...' if len(worlds) > 4 else ''} too"
        raise SimulationError(f"{text}.")

    def _report(self, loop: Loop, culprits: list[Culprit], action: str, substeps: int) -> None:
        for culprit in culprits:
            incident = self._incident(loop, culprit, action, substeps)
            self.incidents.append(incident)
            warnings.warn(str(incident), SimulationWarning, stacklevel=5)

    def _retry(self, frames: Frames, culprits: list[Culprit]) -> None:
        """Do the frame again with more substeps, in the worlds that need it."""
        worlds, substeps = [each.world for each in culprits], self.settings.substeps
        for _ in range(self.settings.retries):
            substeps *= 2
            frames.snapshot.restore()
            frames.run(substeps)
            still = {each.world for each in self._wrong(frames, substeps)}
            if not still & set(worlds):
                break
        else:
            self._stop(frames, culprits, substeps)
        if len(worlds) < self.model.world_count:
            # The others go on from what they had; the multipliers kept are per their own substep.
            better = frames.snapshot.rows(worlds)
            frames.snapshot.restore()
            frames.run(self.settings.substeps)
            frames.snapshot.put(better, {"_lam": (substeps / self.settings.substeps) ** 2})
        self._report(frames.loop, culprits, "retry", substeps)

    def _freeze(self, frames: Frames, culprits: list[Culprit]) -> None:
        """Hold these worlds at the last good frame from now on, and let the others have theirs."""
        worlds = [each.world for each in culprits]
        frames.snapshot.restore()
        shown = self._shown_at_start(frames.loop)
        self.frozen |= set(worlds)
        self._hold(frames, worlds, shown)
        frames.close()  # what is recorded does not hold them yet
        frames.snapshot.restore()
        frames.run(self.settings.substeps)
        self._report(frames.loop, culprits, "freeze", self.settings.substeps)

    def _shown_at_start(self, loop: Loop) -> dict[str, np.ndarray]:
        """Arrays that go with the forces, at the last good frame."""
        if any(name in loop.state for name in SHOWN):
            loop.forces(self.settings.substep)
        return self._shown(loop)

    def _hold(self, frames: Frames, worlds: Iterable[int], shown: dict[str, Any]) -> None:
        """Gather what is to be put back every frame; ``shown`` is so in ``worlds``."""
        self._mark.assign(np.isin(np.arange(self.model.world_count), list(self.frozen)).astype(int))
        before = {id(array): copy for _, copy, array in self._held}
        snapshot = frames.snapshot
        copies = {id(array): snapshot.copies[n] for n, array in snapshot.arrays.items()}
        self._held = []
        for name, (array, world) in snapshot.by_world().items():
            copy = copies.get(id(array))
            if copy is None and name.removeprefix("state/") in shown:
                copy = before.get(id(array), wp.clone(array))
                host, rows = copy.numpy().copy(), np.isin(world, list(worlds))
                host[rows] = shown[name.removeprefix("state/")][rows]
                copy.assign(host)
            if copy is not None:
                self._held.append((self.model.array(world, wp.int32), copy, array))

    # What others do ---------------------------------------------------------------------------

    def placed(self, loop: Loop, worlds: Iterable[int]) -> None:
        """Positions or velocities in these worlds were written from outside."""
        self.limits.follow(loop.get("position"), loop.get("velocity"), worlds)

    def reset(self, frames: Frames, worlds: Iterable[int]) -> None:
        """These worlds are at their start again, and free."""
        self.limits.reset(worlds)
        self.flag.zero_()
        if self.frozen & set(worlds):
            self.frozen -= set(worlds)
            frames.close()
            if self.frozen:
                self._hold(frames, (), self._shown(frames.loop))
            else:
                self._held = []

    def resume(self, frames: Frames, frozen: Iterable[int]) -> None:
        """Go on from a checkpoint, in which these worlds are frozen."""
        self.placed(frames.loop, range(self.model.world_count))
        self.frozen = set(frozen)
        if self.frozen:
            self._hold(frames, self.frozen, self._shown(frames.loop))
            frames.close()

    def _shown(self, loop: Loop) -> dict[str, np.ndarray]:
        return {name: loop.get(name) for name in SHOWN if name in loop.state}


def _triple(values: np.ndarray) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z
