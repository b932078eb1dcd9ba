"""How kernels run: recorded once, then replayed as a graph or as chunks on threads.

:func:`launch` runs a kernel at once, or appends it to the :class:`Program` that is being recorded.
A program is a flat list of launches, host calls and conditional parts; the simulation records one
substep and replays it. However a launch is cut, the result is the same: graph, threads and any
number of them agree bit for bit.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any

import warp as wp

from ...kernels.warp_watch import watched

CHUNK = 512  # particles under which a launch is not worth cutting

# Of each thread its own: what another one launches meanwhile is none of this program.
_program: ContextVar[Program | None] = ContextVar("program", default=None)
_owner: ContextVar[str] = ContextVar("owner", default="loop")


@dataclass
class Launch:
    """One kernel launch."""

    kernel: Any
    dim: int
    inputs: Sequence[Any]
    device: Any
    owner: str = ""
    block: int = 1  # rows that a thread takes

    @property
    def threads(self) -> int:
        """How many there are, one for each block of rows."""
        return -(-self.dim // self.block)

    def issue(self) -> None:
        wp.launch(self.kernel, self.threads, [0, *self.inputs], device=self.device)

    def record(self, chunks: int = 1, least: int = CHUNK) -> list[Any]:
        """Commands with packed arguments: a chunk is the same launch from another first row.

        Args:
            chunks: How many at most.
            least: Rows of a chunk.
        """
        pieces = max(1, min(chunks, self.threads, self.dim // least))
        edges = [self.threads * k // pieces for k in range(pieces + 1)]
        spans = [(start, stop - start) for start, stop in itertools.pairwise(edges)]
        return [
            wp.launch(self.kernel, n, [start, *self.inputs], device=self.device, record_cmd=True)
            for start, n in spans
        ]


@dataclass
class Whole(Launch):
    """A launch by ``wp.launch``, whose kernel knows of no first row: it is never cut."""

    arguments: dict[str, Any] = field(default_factory=dict)

    def issue(self) -> None:
        wp.launch(**self.arguments)

    def record(self, chunks: int = 1, least: int = CHUNK) -> list[Any]:
        return [wp.launch(**self.arguments, record_cmd=True)]


@dataclass
class Call:
    """Work that Warp offers as a function: a grid build, a fill, a copy."""

    function: Callable[[], None]

    def issue(self) -> None:
        self.function()


@dataclass
class Host(Call):
    """What somebody does by himself in every substep, with Python or NumPy: no graph can."""

    owner: str
    reason: str


@dataclass
class When:
    """A part that runs only if a flag on the device is set."""

    flag: wp.array
    body: Program

    def issue(self) -> None:
        wp.capture_if(self.flag, on_true=self.body.issue)


class While(When):
    """A part that runs again and again for as long as its flag is set, which it unsets itself."""

    def issue(self) -> None:
        wp.capture_while(self.flag, self.body.issue)


@dataclass
class Program:
    """A recorded sequence of device work."""

    operations: list[Launch | Call | When] = field(default_factory=list)
    touched: bool = False  # something was launched, be it over no rows
    hosts: dict[int, str] = field(default_factory=dict)  # ids of who cannot be recorded, and why
    acted: set[int] = field(default_factory=set)  # ids of who did something

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

    def add(self, operation: Launch | Call | When) -> None:
        """Append what was asked for."""
        self.operations.append(operation)
        self.touched = True


class _Recorder:
    """Records what is asked of Warp itself (a :class:`~particlesim.kernels.warp_watch.Watcher`)."""

    def launch(self, arguments: dict[str, Any]) -> None:
        dim = arguments["dim"]
        rows = math.prod(dim) if isinstance(dim, Sequence) else int(dim)
        device = arguments.get("device")
        inputs = [*arguments.get("inputs", ()), *arguments.get("outputs", ())]
        _now().add(Whole(arguments["kernel"], rows, inputs, device, _owner.get(), 1, arguments))

    def call(self, run: Callable[[], None]) -> None:
        _now().add(Call(run))

    def host(self, what: str) -> None:
        """Outside of what parts do, the framework knows what it asks for."""
        if _acting.get():
            raise OnHost(what)


class OnHost(BaseException):
    """Ends what a part does while it is recorded: no program can hold it."""


_acting: ContextVar[bool] = ContextVar("acting", default=False)


@contextmanager
def _set(variable: ContextVar[Any], value: Any) -> Iterator[None]:
    token = variable.set(value)
    try:
        yield
    finally:
        variable.reset(token)


def _now() -> Program:
    program = _program.get()
    assert program is not None
    return program


def recording() -> Program | None:
    """What is being recorded in this thread."""
    return _program.get()


@contextmanager
def record(program: Program, *, strict: bool = False) -> Iterator[Program]:
    """Append the launches made inside to ``program`` instead of running them.

    Args:
        program: To append to.
        strict: What cannot be appended raises :class:`OnHost`.
    """
    with _set(_program, program), _set(_acting, strict or _acting.get()), watched(_Recorder()):
        yield program


@contextmanager
def owner(name: str) -> Iterator[None]:
    """Remember who made the launches inside, for ``explain``."""
    with _set(_owner, name):
        yield


def launch(kernel: Any, dim: int, inputs: Sequence[Any], device: Any, block: int = 1) -> None:
    """Launch a kernel over ``dim`` rows: now, or each time that what is being recorded is run.

    This is how an interaction, a constraint or an integrator of your own runs a kernel in its
    ``apply``, ``project`` or ``advance``: the launch becomes part of the frame, which is recorded
    once and then replayed, as a graph or by threads.

    The kernel's first argument is ``first: int``, which it adds to ``wp.tid()`` for the number of
    its row. Threads share a launch by cutting it into chunks, each a launch from another ``first``,
    and ``wp.tid()`` counts from 0 in every one of them. Chunks run in any order and at once, so a
    thread writes its own row only, or what every thread would write the same; it reads what it
    likes of arrays that the launch does not write. Atomics are no way out: on a CPU they are plain
    additions.

    In a frame, ``inputs`` are taken as they are when it is recorded: numbers keep their values, and
    arrays must stay where they are and be written in place. Nothing runs until the frame does, so
    there is nothing to read back in between (``.numpy()``), and nothing is to be allocated.

    Args:
        kernel: Made by ``wp.kernel``. Its arguments are ``first`` and then those of ``inputs``.
        dim: Rows; nothing happens for 0.
        inputs: What the kernel takes after ``first``: arrays, structs, numbers.
        device: Where the arrays are: ``model.device``.
        block: Rows that a thread takes; what the kernel adds up is then the number of its block.

    Example:
        >>> @wp.kernel
        ... def lift(first: int, speed: float, velocity: wp.array(dtype=wp.vec3)):
        ...     i = first + wp.tid()
        ...     velocity[i] = velocity[i] + wp.vec3(0.0, speed, 0.0)
        >>> velocity = wp.zeros(2, dtype=wp.vec3, device="cpu")
        >>> launch(lift, 2, [0.5, velocity], "cpu")
        >>> velocity.numpy().tolist()
        [[0.0, 0.5, 0.0], [0.0, 0.5, 0.0]]
    """
    program = _program.get()
    if dim == 0:
        if program is not None:
            program.touched = True
        return
    operation = Launch(kernel, dim, inputs, device, _owner.get(), block)
    if program is not None:
        program.add(operation)
    else:
        operation.issue()


def call(function: Callable[[], None]) -> None:
    """Run ``function``, which enqueues device work and nothing else, in its turn."""
    program = _program.get()
    if program is not None:
        program.add(Call(function))
    else:
        function()


@contextmanager
def when(flag: wp.array, kind: type[When] = When) -> Iterator[None]:
    """Run what is launched inside only if ``flag`` (one int32 on the device) is not zero."""
    body = Program()
    with record(body):
        yield
    program, operation = _program.get(), kind(flag, body)
    if program is not None:
        program.add(operation)
    else:
        operation.issue()


def repeat(flag: wp.array) -> AbstractContextManager[None]:
    """Run what is launched inside again and again, until ``flag`` is zero, as it makes it."""
    return when(flag, While)
