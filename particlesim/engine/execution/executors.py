"""How recorded frames are run: as a captured graph, on threads, or launch by launch."""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Callable, Sequence
from typing import Any

import warp as wp

from ...kernels.warp_internals import part_captures
from ...scene.settings import Settings
from .frame import Frame
from .launch import CHUNK, Launch, Program, When, While, Whole
from .threads import Chain, Team

LARGEST_GRAPH = 4096  # operations
CHUNK_SECONDS = 4e-6  # a chunk that takes less is not worth its handing out
CHUNKS_PER_THREAD = (1, 4, 16)  # many, so that a thread that is held up delays nobody


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
    part_captures()
    with wp.ScopedCapture(device=device) as capture:
        for part in parts:
            part.issue()
    return capture.graph


class EagerExecutor:
    """Runs a frame launch by launch, as it would be without any recording.

    The way out where a part acts on the host, or a driver cannot capture a frame, conditional parts
    above all: slower, since the host looks at every flag, but the same.
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
    """Replays a frame in native code, its larger launches cut into chunks over CPU threads."""

    name = "threads"

    def __init__(self, frame: Frame, threads: int):
        self.team = Team(threads)
        before, substep, after = (_steps(part, self.team, threads) for part in frame.parts)
        self._parts = [(before, 1), (substep, frame.repeat), (after, 1)]

    def run(self) -> None:
        for steps, times in self._parts:
            for _ in range(times):
                for step in steps:
                    step()

    def close(self) -> None:
        """End the worker threads."""
        self.team.close()


def _steps(program: Program, team: Team, threads: int) -> list[Callable[[], None]]:
    """A program as functions to call in turn: launches without a gap are one of them."""
    steps: list[Callable[[], None]] = []
    launches: list[Launch] = []
    for operation in program.operations:
        if isinstance(operation, Launch) and not isinstance(operation, Whole):
            launches.append(operation)
            continue
        if launches:
            steps.append(_Run(launches, team, threads).run)
            launches = []
        if isinstance(operation, When):
            inside = _If(operation.flag, _steps(operation.body, team, threads))
            steps.append(inside.again if isinstance(operation, While) else inside.run)
        elif isinstance(operation, Whole):
            steps.append(operation.record()[0].launch)
        else:
            steps.append(operation.function)
    if launches:
        steps.append(_Run(launches, team, threads).run)
    return steps


class _Run:
    """Launches that follow one another. The first time they are timed, to be cut sensibly."""

    def __init__(self, launches: list[Launch], team: Team, threads: int):
        # Recorded now: nothing is to be compiled in the middle of a frame.
        cuts = [1, *(threads * each for each in CHUNKS_PER_THREAD if threads > 1)]
        self.choices = [[each.record(pieces) for pieces in cuts] for each in launches]
        self.team = team
        self.chain: Chain | None = None

    def run(self) -> None:
        if self.chain is not None:
            self.team.run(self.chain)
            return
        stages = []
        for whole, *cuts in self.choices:
            start = time.perf_counter()
            whole[0].launch()
            seconds = time.perf_counter() - start
            worth = [cut for cut in cuts if seconds > CHUNK_SECONDS * len(cut)]
            stages.append(worth[-1] if worth else whole)
        self.chain = Chain(stages)
        self.choices.clear()


class _If:
    """A conditional part. On the CPU the flag is the memory itself: a look needs no copy."""

    def __init__(self, flag: wp.array, steps: list[Callable[[], None]]):
        self.flag, self.steps = flag.numpy(), steps

    def run(self) -> None:
        if self.flag[0]:
            for step in self.steps:
                step()

    def again(self) -> None:
        """Until the flag is unset."""
        while self.flag[0]:
            self.run()


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
        if self.frame.host:
            return EagerExecutor(self.frame)
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
