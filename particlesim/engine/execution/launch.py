"""How kernels run: recorded once, then replayed as a graph or as chunks on threads.

:func:`launch` runs a kernel at once, or appends it to the :class:`Program` that is being recorded.
A program is a flat list of launches, host calls and conditional parts; the simulation records one
substep and replays it. Every kernel takes ``first: int`` as its first argument and adds it to
``wp.tid()``, so that a launch can be cut into chunks. A kernel writes only its own rows, hence the
result does not depend on how it is cut: graph, threads and any number of them agree bit for bit.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import warp as wp

CHUNK = 512  # particles under which a launch is not worth cutting

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

    def issue(self) -> None:
        wp.launch(self.kernel, self.dim, [0, *self.inputs], device=self.device)

    def record(self, chunks: int = 1, least: int = CHUNK) -> list[Any]:
        """Commands with packed arguments: a chunk is the same launch from another first row.

        Args:
            chunks: How many at most.
            least: Rows of a chunk.
        """
        pieces = max(1, min(chunks, self.dim // least))
        edges = [self.dim * k // pieces for k in range(pieces + 1)]
        return [
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
                operation.record()
