"""How kernels run: recorded once, then replayed as a graph or as chunks on threads.

:func:`launch` runs a kernel at once, or appends it to the :class:`Program` that is being recorded.
A program is a flat list of launches, host calls and conditional parts; the simulation records one
substep and replays it. Every kernel takes ``first: int`` as its first argument and adds it to
``wp.tid()``, so that a launch can be cut into chunks. A kernel writes only its own rows, hence the
result does not depend on how it is cut: graph, threads and any number of them agree bit for bit.
"""

from __future__ import annotations

import itertools
import os
import queue
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import warp as wp

from .settings import Settings

CHUNK = 1024  # particles under which a launch is not worth cutting
LARGEST_GRAPH = 4096  # operations
CHUNKS_PER_THREAD = 4  # so that a thread that is held up does not hold up the others

_recording: list[Program] = []
_owners: list[str] = ["loop"]


@dataclass
class Launch:
    """One kernel launch."""

    kernel: Any
    dim: int
    inputs: Sequence[Any]
    device: Any
    owner: str = ""
    commands: list[Any] = field(default_factory=list)

    def issue(self) -> None:
        wp.launch(self.kernel, self.dim, [0, *self.inputs], device=self.device)

    def record(self, chunks: int) -> None:
        """Pack the arguments once: a chunk is the same launch from another first row."""
        pieces = max(1, min(chunks, self.dim // CHUNK))
        edges = [self.dim * k // pieces for k in range(pieces + 1)]
        self.commands = [
            wp.launch(
                self.kernel,
                stop - start,
                [start, *self.inputs],
                device=self.device,
                record_cmd=True,
            )
            for start, stop in itertools.pairwise(edges)
        ]


@dataclass
class Call:
    """Work that Warp offers as a function: a grid build, a fill, a copy."""

    function: Callable[[], None]

    def issue(self) -> None:
        self.function()


@dataclass
class When:
    """A part that runs only if a flag on the device is set."""

    flag: wp.array
    body: Program

    def issue(self) -> None:
        wp.capture_if(self.flag, on_true=self.body.issue)


@dataclass
class Program:
    """A recorded sequence of device work."""

    operations: list[Launch | Call | When] = field(default_factory=list)

    def issue(self) -> None:
        for operation in self.operations:
            operation.issue()

    def launches(self) -> Iterator[Launch]:
        """Every launch, those inside conditional parts too."""
        for operation in self.operations:
            if isinstance(operation, Launch):
                yield operation
            elif isinstance(operation, When):
                yield from operation.body.launches()


@contextmanager
def record(program: Program) -> Iterator[Program]:
    """Append the launches made inside to ``program`` instead of running them."""
    _recording.append(program)
    try:
        yield program
    finally:
        _recording.pop()


@contextmanager
def owner(name: str) -> Iterator[None]:
    """Remember who made the launches inside, for ``explain``."""
    _owners.append(name)
    try:
        yield
    finally:
        _owners.pop()


def launch(kernel: Any, dim: int, inputs: Sequence[Any], device: Any) -> None:
    """Launch ``kernel`` over ``dim`` rows with ``inputs`` after its ``first`` argument."""
    if dim == 0:
        return
    operation = Launch(kernel, dim, inputs, device, _owners[-1])
    if _recording:
        _recording[-1].operations.append(operation)
    else:
        operation.issue()


def call(function: Callable[[], None]) -> None:
    """Run ``function``, which enqueues device work and nothing else, in its turn."""
    if _recording:
        _recording[-1].operations.append(Call(function))
    else:
        function()


@contextmanager
def when(flag: wp.array) -> Iterator[None]:
    """Run what is launched inside only if ``flag`` (one int32 on the device) is not zero."""
    body = Program()
    with record(body):
        yield
    if _recording:
        _recording[-1].operations.append(When(flag, body))
    elif flag.numpy()[0]:
        body.issue()


@dataclass
class Frame:
    """What a frame does: its start, its substep ``repeat`` times, and its end."""

    repeat: int
    before: Program = field(default_factory=Program)
    substep: Program = field(default_factory=Program)
    after: Program = field(default_factory=Program)

    @property
    def largest(self) -> int:
        """Rows of the largest launch."""
        return max((each.dim for part in self.parts for each in part.launches()), default=0)

    @property
    def parts(self) -> tuple[Program, Program, Program]:
        """The three programs."""
        return self.before, self.substep, self.after

    def load(self) -> None:
        """Compile and load every kernel now rather than in the middle of a capture."""
        for part in self.parts:
            for operation in part.launches():
                operation.record(1)


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
        frame.load()
        self.frame = frame
        self._flags: dict[int, np.ndarray] = {}
        for part in frame.parts:
            for operation in part.launches():
                operation.record(threads * CHUNKS_PER_THREAD if threads > 1 else 1)
        self._tasks: queue.SimpleQueue = queue.SimpleQueue()
        self._done: queue.SimpleQueue = queue.SimpleQueue()
        self._workers = [
            threading.Thread(target=_work, args=(self._tasks, self._done), daemon=True)
            for _ in range(threads - 1)
        ]
        for worker in self._workers:
            worker.start()

    def run(self) -> None:
        self._run(self.frame.before)
        for _ in range(self.frame.repeat):
            self._run(self.frame.substep)
        self._run(self.frame.after)

    def _run(self, program: Program) -> None:
        for operation in program.operations:
            if isinstance(operation, Launch):
                self._launch(operation.commands)
            elif isinstance(operation, Call):
                operation.function()
            elif self._flag(operation.flag)[0]:
                self._run(operation.body)

    def _flag(self, flag: wp.array) -> np.ndarray:
        """The flag's memory itself: on the CPU a look needs no copy."""
        if flag.ptr not in self._flags:
            self._flags[flag.ptr] = flag.numpy()
        return self._flags[flag.ptr]

    def _launch(self, commands: list[Any]) -> None:
        if len(commands) == 1 or not self._workers:
            for command in commands:
                command.launch()
            return
        todo = list(commands)
        for _ in self._workers:
            self._tasks.put(todo)
        failure = _drain(todo)
        for _ in self._workers:
            failure = self._done.get() or failure
        if failure is not None:
            raise failure

    def close(self) -> None:
        """End the worker threads."""
        for _ in self._workers:
            self._tasks.put(None)
        self._workers = []

    def __del__(self) -> None:
        self.close()


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


def _work(tasks: queue.SimpleQueue, done: queue.SimpleQueue) -> None:
    """A worker thread: it knows the queues only, so that its executor can be let go."""
    while (todo := tasks.get()) is not None:
        done.put(_drain(todo))


def _drain(todo: list[Any]) -> Exception | None:
    """Run commands off the shared list until it is empty; list.pop is atomic."""
    try:
        while True:
            todo.pop().launch()
    except IndexError:
        return None
    except Exception as failure:
        return failure


def available_threads() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
