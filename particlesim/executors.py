"""How recorded frames are run: as a captured graph, on threads, or launch by launch."""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from .launch import CHUNK, Call, Frame, Launch, Program
from .settings import Settings
from .threads import Shared, Team

LARGEST_GRAPH = 4096  # operations
WORTH_SHARING = 5e-5  # seconds of a launch; handing it round takes a fifth of that
CHUNKS_PER_THREAD = 16  # so that a thread that is held up does not hold up the others


class GraphExecutor:
    """Replays a frame as a captured graph: the cheapest launch, on one core of a CPU."""

    name = "graph"

    def __init__(self, frame: Frame, device: Any):
        frame.load()
        # A graph of many nodes takes long to capture: beyond a point the substep's is replayed.
        whole = frame.repeat * len(frame.substep.operations) <= LARGEST_GRAPH
        if whole:
            middle = [frame.substep] * frame.repeat
            self.graphs = [(_capture([frame.before, *middle, frame.after], device), 1)]
        else:
            self.graphs = [
                (_capture([frame.before], device), 1),
                (_capture([frame.substep], device), frame.repeat),
                (_capture([frame.after], device), 1),
            ]

    def run(self) -> None:
        for graph, times in self.graphs:
            for _ in range(times):
                wp.capture_launch(graph)

    def close(self) -> None:
        """Nothing to end."""


def _capture(parts: Sequence[Program], device: Any) -> Any:
    with wp.ScopedCapture(device=device) as capture:
        for part in parts:
            part.issue()
    return capture.graph


class EagerExecutor:
    """Runs a frame launch by launch, as it would be without any recording.

    The way out where a driver cannot capture a frame, conditional parts above all: slower, since
    the host looks at every flag, but the same.
    """

    name = "eager"

    def __init__(self, frame: Frame):
        self.frame = frame

    def run(self) -> None:
        self.frame.before.issue()
        for _ in range(self.frame.repeat):
            self.frame.substep.issue()
        self.frame.after.issue()

    def close(self) -> None:
        """Nothing to end."""


class ThreadExecutor:
    """Replays a frame launch by launch, each cut into chunks over CPU threads."""

    name = "threads"

    def __init__(self, frame: Frame, threads: int):
        self.frame = frame
        self._flags: dict[int, np.ndarray] = {}
        self._whole: dict[int, Any] = {}
        self._chunks: dict[int, Shared] = {}
        self._shared: dict[int, bool] = {}  # whether a launch is worth sharing, once timed
        for part in frame.parts:
            for operation in part.launches():
                operation.record(1)
                self._whole[id(operation)] = operation.commands[0]
                if threads > 1:
                    operation.record(threads * CHUNKS_PER_THREAD)
                    if len(operation.commands) > 1:
                        self._chunks[id(operation)] = Shared(operation.commands)
        self.team = Team(threads) if threads > 1 else None

    def run(self) -> None:
        self._run(self.frame.before)
        for _ in range(self.frame.repeat):
            self._run(self.frame.substep)
        self._run(self.frame.after)

    def _run(self, program: Program) -> None:
        for operation in program.operations:
            if isinstance(operation, Launch):
                self._launch(operation)
            elif isinstance(operation, Call):
                operation.function()
            elif self._flag(operation.flag)[0]:
                self._run(operation.body)

    def _flag(self, flag: wp.array) -> np.ndarray:
        """The flag's memory itself: on the CPU a look needs no copy."""
        if flag.ptr not in self._flags:
            self._flags[flag.ptr] = flag.numpy()
        return self._flags[flag.ptr]

    def _launch(self, operation: Launch) -> None:
        key = id(operation)
        if self.team is not None and self._shared.get(key):
            self.team.run(self._chunks[key])
            return
        start = time.perf_counter()
        self._whole[key].launch()
        if key in self._chunks and key not in self._shared:
            self._shared[key] = time.perf_counter() - start > WORTH_SHARING

    def close(self) -> None:
        """End the worker threads."""
        if self.team is not None:
            self.team.close()
            self.team = None


AnyExecutor = GraphExecutor | EagerExecutor | ThreadExecutor


class Executor:
    """Runs frames by graph or threads: as set, or whichever has measured faster.

    Both give the same result, so the first frames are run by either and timed.
    """

    TRIALS = 2  # of each; the faster of them counts, since what disturbs only slows

    def __init__(self, frame: Frame, settings: Settings, device: Any):
        self.frame, self.device = frame, device
        self.threads = settings.threads or available_threads()
        self.chosen: AnyExecutor | None = None
        self._times: dict[str, list[float]] = {"graph": [], "threads": []}
        self._tried: dict[str, AnyExecutor] = {}
        way = settings.execution
        small = self.threads == 1 or frame.largest < 2 * CHUNK
        if not device.is_cpu or (way == "auto" and small):
            way = "graph"
        if way != "auto":
            self.chosen = self._make(way)

    def _make(self, way: str) -> AnyExecutor:
        if way == "threads":
            return ThreadExecutor(self.frame, self.threads)
        try:
            return GraphExecutor(self.frame, self.device)
        except RuntimeError as error:
            if self.device.is_cpu:
                raise
            warnings.warn(
                f"Simulation: {self.device} cannot capture a frame ({error}); running it launch "
                "by launch, which is slower.",
                stacklevel=2,
            )
            return EagerExecutor(self.frame)

    def run(self) -> None:
        """Run one frame."""
        if self.chosen is not None:
            self.chosen.run()
            return
        way = min(self._times, key=lambda name: len(self._times[name]))
        if way not in self._tried:
            self._tried[way] = self._make(way)
        start = time.perf_counter()
        self._tried[way].run()
        self._times[way].append(time.perf_counter() - start)
        if all(len(times) >= self.TRIALS for times in self._times.values()):
            best = min(self._times, key=lambda name: min(self._times[name]))
            self.chosen = self._tried.pop(best)
            for other in self._tried.values():
                other.close()
            self._tried.clear()

    def close(self) -> None:
        """End what runs beside."""
        for each in [self.chosen, *self._tried.values()]:
            if each is not None:
                each.close()


def available_threads() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
