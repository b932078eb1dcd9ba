"""Run: one way to simulate a scene, while it is measured."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import warp as wp

from ..engine.execution.executors import Executor
from ..instruments.watchdog.incident import SimulationError
from .stopwatch import BLOCK, Pass, undisturbed
from .study import Plan, Study

WARM_UP = 2 * Executor.TRIALS  # frames after which it is chosen how frames are executed
LEAST = 0.05  # seconds of all repeats together, so that the clock's grain does not show
PASSES = 2000  # of a repeat, at most


class Run:
    """A simulation, its times, and what has become of it.

    ``sim`` is timed. ``judged`` is what errors are of: the same one; or, of a study with several
    seeds, a batch with a world for each. ``cause`` says why the run counts as diverged, and is
    empty while it does not; ``errors`` holds one a world. ``set_up`` and ``compiling`` are the
    seconds of making the simulation, and those that its first frames took longer than later ones.
    """

    def __init__(self, study: Study, plan: Plan):
        start = time.perf_counter()
        self.study, self.plan, self.sim = study, plan, study.simulation(plan)
        self.set_up, self.compiling = time.perf_counter() - start, 0.0
        self.judged = self.sim if len(study.seeds) < 2 else study.batch(plan)
        self.block = 1  # frames that are timed together
        self.least = 0.0  # seconds of a repeat
        self.repeats: list[list[Pass]] = []
        self.cause, self.error = "", math.nan
        self.errors: tuple[float, ...] = ()
        self.parts: dict[str, float] = {}  # further errors, by name
        self.notes: dict[str, Any] = {}  # what the error needs to remember

    def settle(self, errors: Any) -> None:
        """Take the errors of the worlds, (worlds,); ``error`` is their median."""
        self.errors = tuple(float(each) for each in errors)
        with np.errstate(all="ignore"):
            self.error = float(np.median(self.errors)) if self.errors else math.nan

    def warm_up(self) -> None:
        """Compile, capture and choose how to execute, then go back to the start."""
        times = []
        try:
            for _ in range(WARM_UP):
                start = time.perf_counter()
                self.sim.step()
                wp.synchronize_device(self.sim.device)
                times.append(time.perf_counter() - start)
                if self.sim.executor.chosen is not None and len(times) > 1:
                    break
        except SimulationError as error:
            self.cause = str(error)
        self.sim.reset()
        if times:
            usual = min(times)
            self.compiling = sum(times) - len(times) * usual
            self.block = int(min(max(BLOCK / usual, 1.0), self.plan.frames))

    def apart(self, watches: bool) -> bool:
        """Whether what is judged has to run by itself: it is another, or looking would disturb."""
        return self.judged is not self.sim or (watches and self.block > 1)

    def examine(self, watch: Callable[[Run], None] | None) -> None:
        """Run all frames of what is judged, untimed."""
        self.judged.reset()
        try:
            if watch:
                watch(self)
            for _ in range(self.plan.frames):
                self.judged.step()
                if watch:
                    watch(self)
        except SimulationError as error:
            self.cause = str(error)

    def advance(self, watch: Callable[[Run], None] | None, after_frame: Callable[[], None]) -> None:
        """Run all frames from the start, again until enough time is measured.

        Args:
            watch: Called at the start and after every frame, unless it is None.
            after_frame: Called after every frame of the first pass, done or not.
        """
        passes = [self._pass(watch, after_frame)]
        while (
            not self.cause
            and len(passes) < PASSES
            and sum(sum(each.wall) for each in passes) < self.least
        ):
            passes.append(self._pass(None, None))
        if passes[0].frames:
            self.repeats.append(passes)

    def _pass(
        self, watch: Callable[[Run], None] | None, after_frame: Callable[[], None] | None
    ) -> Pass:
        """All frames from the start; only the frames themselves are timed."""
        one, total, counted = Pass(), self.plan.frames, 0
        self.sim.reset()
        try:
            if watch:
                watch(self)
            while one.frames < total:
                one.time(self.sim, min(self.block, total - one.frames))
                while after_frame and counted < one.frames:
                    after_frame()
                    counted += 1
                if watch:
                    watch(self)
        except SimulationError as error:
            self.cause = str(error)
        while after_frame and counted < total:
            after_frame()
            counted += 1
        return one

    @property
    def times(self) -> list[tuple[float, float]]:
        """Wall and CPU seconds per simulated second, one pair a repeat."""
        every = [each for passes in self.repeats for each in passes]
        found = []
        for passes in self.repeats:
            span = min(each.frames for each in every) * self.sim.settings.dt
            wall, cpu = undisturbed(passes, every)
            found.append((wall / span, cpu / span))
        return found

    @property
    def costs(self) -> list[float]:
        """Wall seconds per simulated second, one figure a repeat."""
        return [wall for wall, _ in self.times]

    @property
    def memory(self) -> int:
        """Bytes of all arrays of the simulation; they only ever grow."""
        return array_bytes(self.sim)


def array_bytes(thing: Any) -> int:
    """Bytes of the Warp arrays that ``thing`` holds, each counted once."""
    seen: set[int] = set()
    sizes: dict[int, int] = {}
    todo = [thing]
    while todo:
        each = todo.pop()
        if id(each) in seen:
            continue
        seen.add(id(each))
        if isinstance(each, wp.array):
            if each.ptr and each.deleter is not None:  # a view owns nothing
                sizes[each.ptr] = each.capacity
        elif isinstance(each, dict):
            todo += each.values()
        elif isinstance(each, list | tuple):
            todo += each
        elif type(each).__module__.startswith("particlesim"):
            todo.append(getattr(each, "__dict__", {}))
    return sum(sizes.values())
