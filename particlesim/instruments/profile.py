"""Profile: what each pass of a run's frames takes, measured launch by launch.

Every operation has a clock of its own around it, so that a frame takes longer than it does as a
graph: by some microseconds a launch, which are counted as between the launches. It does the same
work in the same order, so that no bit of the result changes.
"""

from __future__ import annotations

import contextlib
import functools
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import warp as wp

from ..engine.execution.executors import available_threads
from ..engine.execution.frame import Frame
from ..engine.execution.launch import CHUNK, Host, Launch, Program, When, While
from ..engine.execution.threads import Chain, Team
from ..engine.frames import Frames
from ..engine.loop import Loop
from ..engine.report import Report, grid
from ..scene.settings import Settings
from .explain import kernel_name

LEAST = 1000  # bytes that are worth a word
PIECES = 4  # for each thread, of a launch that is shared


@dataclass
class Pass:
    """Launches of one kernel for one part, or work that Warp offers as a function.

    owner: the part. name: the kernel. launches, seconds: in all. bytes: of the arrays that one
    launch names, each counted once and whole: at most what it reads and writes, but for what it
    does twice. Arrays that are known by a number only, as a hash grid's, are not seen.
    """

    owner: str
    name: str
    bytes: int = 0
    launches: int = 0
    seconds: float = 0.0


@dataclass(repr=False)
class Profile(Report):
    """Where the time of frames has gone. ``str()`` makes the table.

    title: what was run. passes: in the order of the frame. builds: how often each pair list was
    made, by its users. frames, substeps: that were run, those that were done again included.
    in_frames: seconds of them; seconds: from beginning to end, with what was done besides.
    """

    title: str
    passes: list[Pass] = field(default_factory=list)
    builds: dict[str, int] = field(default_factory=dict)
    frames: int = 0
    substeps: int = 0
    in_frames: float = 0.0
    seconds: float = 0.0

    @property
    def in_passes(self) -> float:
        """Seconds in launches, fills, copies and grid builds."""
        return sum(each.seconds for each in self.passes)

    def find(self, owner: str, name: str, size: int) -> Pass:
        """The pass of that name, a new one if need be; ``size``: its bytes now."""
        for each in self.passes:
            if (each.owner, each.name) == (owner, name):
                each.bytes = max(each.bytes, size)
                return each
        self.passes.append(Pass(owner, name, size))
        return self.passes[-1]

    def __str__(self) -> str:
        frames, total = max(1, self.frames), max(self.seconds, 1e-12)
        lines = [f"{self.title}, {self.frames} frames, launch by launch", ""]
        heads = ["pass", "kernel", "launches", "a frame", "share", "bytes a launch", "rate"]
        sides = ["left", "left", *["right"] * 5]
        rows = []
        for each in sorted(self.passes, key=lambda each: -each.seconds):
            if each.launches:
                rate = each.bytes * each.launches / max(each.seconds, 1e-12) / 1e9
                rows.append(
                    [
                        each.owner, each.name, f"{round(each.launches / frames, 1):g}",
                        f"{each.seconds / frames * 1e3:.3f} ms", _share(each.seconds, total),
                        f"{each.bytes / 1e6:.3g} MB" if each.bytes >= LEAST else "-",
                        f"{rate:.3g} GB/s" if each.bytes >= LEAST else "-",
                    ]
                )  # fmt: skip
        between, outside = self.in_frames - self.in_passes, self.seconds - self.in_frames
        for name, seconds in (("between launches", between), ("outside the frames", outside)):
            rows.append(["", name, "", f"{seconds / frames * 1e3:.3f} ms",
                         _share(seconds, total), "", ""])  # fmt: skip
        lines += [*grid(zip(heads, sides, strict=True), rows), ""]
        for users, times in self.builds.items():
            every = f", every {self.substeps / times:.3g}" if times else ""
            lines.append(
                f"pairs of {users}: listed {times} times in {self.substeps} substeps{every}"
            )
        lines += [
            "Bytes are those of the arrays that a launch names, whole: at most what it moves.",
            "Between the launches: Python, which a graph does not have. Outside the frames: "
            "rounds of the watchdog, recording.",
        ]
        return "\n".join(lines)


def _share(seconds: float, total: float) -> str:
    return f"{100 * seconds / total:.1f} %"


@contextlib.contextmanager
def profiled(frames: Frames) -> Iterator[Profile]:
    """Frames that are run inside go launch by launch, and are measured."""
    loop = frames.loop
    settings, model = loop.settings, loop.model
    threads = settings.threads or available_threads()
    found = Profile(
        f"{model.particle_count} particles on {model.device}, {settings.precision}, "
        f"{settings.substeps} substeps"
        + (f", {threads} thread{'s' if threads > 1 else ''}" if model.device.is_cpu else "")
    )
    found.builds = {", ".join(each.users): 0 for each in loop.neighbors.lists if _flags(each)}
    before = frames.runner
    frames.close()
    frames.runner = functools.partial(Clocked, found, loop)
    try:
        frames.executor(settings.substeps)  # compiling is none of it
        start = time.perf_counter()
        yield found
        found.seconds += time.perf_counter() - start
    finally:
        frames.close()
        frames.runner = before


class Clocked:
    """Runs a frame launch by launch, a clock around each, on as many threads as it would.

    Args:
        profile: To add to.
        loop: Whose frame it is.
        frame: The frame. settings, device: as of an Executor.
    """

    name = "launch by launch, with a clock around each"

    def __init__(self, profile: Profile, loop: Loop, frame: Frame, settings: Settings, device: Any):
        frame.load()
        self.frame, self.chosen, self.profile, self.device = frame, self, profile, device
        self.threads = settings.threads or available_threads()
        shared = device.is_cpu and self.threads > 1 and frame.largest >= 2 * CHUNK
        self.team = Team(self.threads) if shared else None
        self.lists = {
            flag: ", ".join(each.users) for each in loop.neighbors.lists for flag in _flags(each)
        }
        times = (1, frame.repeat, 1)
        self._parts = [
            (self._steps(part), count) for part, count in zip(frame.parts, times, strict=True)
        ]

    def run(self) -> None:
        """Run one frame."""
        start = time.perf_counter()
        for steps, times in self._parts:
            for _ in range(times):
                for step in steps:
                    step()
        self.profile.in_frames += time.perf_counter() - start
        self.profile.frames += 1
        self.profile.substeps += self.frame.repeat

    def close(self) -> None:
        """End the worker threads."""
        if self.team is not None:
            self.team.close()

    def _steps(
        self, program: Program, owner: str = "loop", *, inside: bool = False
    ) -> list[Callable[[], None]]:
        """What to call in turn; a fill or a copy belongs to whoever launched before it."""
        steps: list[Callable[[], None]] = []
        for operation in program.operations:
            if isinstance(operation, When):
                owner = next((each.owner for each in operation.body.launches()), owner)
                # What is inside of a list's making makes it no second time.
                users = None if inside else self.lists.get(operation.flag.ptr)
                steps.append(self._conditional(operation, owner, users))
            elif isinstance(operation, Launch):
                owner = operation.owner
                size = _bytes(operation.inputs)
                found = self.profile.find(owner, kernel_name(operation), size)
                steps.append(self._clock(self._launcher(operation), found))
            elif isinstance(operation, Host):
                found = self.profile.find(operation.owner, "on the host", 0)
                steps.append(self._clock(operation.function, found))
            else:
                name, size = _of_call(operation.function)
                steps.append(self._clock(operation.function, self.profile.find(owner, name, size)))
        return steps

    def _launcher(self, operation: Launch) -> Callable[[], None]:
        pieces = operation.record(1 if self.team is None else PIECES * self.threads)
        if self.team is None or len(pieces) == 1:
            return pieces[0].launch
        return functools.partial(self.team.run, Chain([pieces]))

    def _clock(self, do: Callable[[], None], found: Pass) -> Callable[[], None]:
        cuda = not self.device.is_cpu

        def step() -> None:
            start = time.perf_counter()
            do()
            if cuda:
                wp.synchronize_device(self.device)
            found.seconds += time.perf_counter() - start
            found.launches += 1

        return step

    def _conditional(self, operation: When, owner: str, users: str | None) -> Callable[[], None]:
        steps = self._steps(operation.body, owner, inside=True)
        again = isinstance(operation, While)

        def step() -> None:
            while operation.flag.numpy()[0]:
                if users is not None:
                    self.profile.builds[users] += 1
                for each in steps:
                    each()
                if not again:
                    break

        return step


def _flags(pairs: Any) -> list[int]:
    """Where the flags of a pair list are that say it is to be made anew."""
    arrays = [each for each in vars(pairs).values() if isinstance(each, wp.array)]
    return [each.ptr for each in arrays if each.dtype is wp.int32 and each.size == 1]


def _arrays(values: Any) -> Iterator[wp.array]:
    """All arrays among arguments, those in structs too."""
    for value in values:
        if isinstance(value, wp.array):
            yield value
        elif hasattr(value, "_cls"):
            yield from _arrays(vars(value).values())


def _bytes(values: Any) -> int:
    """Of the arrays among arguments, each once."""
    sizes = {each.ptr: each.size * wp.types.type_size_in_bytes(each.dtype)
             for each in _arrays(values)}  # fmt: skip
    return sum(sizes.values())


def _of_call(function: Callable[..., Any]) -> tuple[str, int]:
    """The name of work that Warp offers as a function, and the bytes of its arrays."""
    values: list[Any] = []
    if isinstance(function, functools.partial):
        values += [*function.args, *function.keywords.values()]
        function = function.func
    values.append(getattr(function, "__self__", None))
    return getattr(function, "__qualname__", type(function).__name__), _bytes(values)
