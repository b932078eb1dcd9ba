"""Run: one way to simulate a scene, while it is measured."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

import warp as wp

from ..engine.execution.executors import Executor
from ..instruments.watchdog.incident import SimulationError
from .study import Plan, Study

WARM_UP = 2 * Executor.TRIALS  # frames after which it is chosen how frames are executed


class Run:
    """A simulation, its wall times, and what has become of it.

    ``costs`` holds one figure a repeat [wall seconds per simulated second]; ``cause`` says why the
    run counts as diverged, and is empty while it does not.
    """

    def __init__(self, study: Study, plan: Plan):
        self.study, self.plan, self.sim = study, plan, study.simulation(plan)
        self.costs: list[float] = []
        self.cause, self.error = "", math.nan
        self.notes: dict[str, Any] = {}  # what the error needs to remember

    def warm_up(self) -> None:
        """Compile, capture and choose how to execute, then go back to the start."""
        try:
            for _ in range(WARM_UP):
                self.sim.step()
                if self.sim.executor.chosen is not None:
                    break
        except SimulationError as error:
            self.cause = str(error)
        self.sim.reset()

    def advance(self, watch: Callable[[Run], None] | None, after_frame: Callable[[], None]) -> None:
        """Run all frames from the start; only the frames themselves are timed.

        Args:
            watch: Called at the start and after every frame, unless it is None.
            after_frame: Called after every frame, done or not.
        """
        sim, seconds, done = self.sim, 0.0, 0
        sim.reset()
        try:
            if watch:
                watch(self)
            for _ in range(self.plan.frames):
                wp.synchronize_device(sim.device)
                start = time.perf_counter()
                sim.step()
                wp.synchronize_device(sim.device)
                seconds += time.perf_counter() - start
                done += 1
                after_frame()
                if watch:
                    watch(self)
        except SimulationError as error:
            self.cause = str(error)
            for _ in range(self.plan.frames - done):
                after_frame()
        if done:
            self.costs.append(seconds / (done * sim.settings.dt))

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
