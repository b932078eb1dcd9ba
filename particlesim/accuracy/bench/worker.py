"""Workers: every entry of a race has a process of its own, which has so many cores and no more.

So a program that crashes ends nobody else, none finds another's threads in its libraries, and
memory is that of one.
"""

from __future__ import annotations

import contextlib
import gc
import multiprocessing
import os
import traceback
from collections.abc import Iterator, Mapping
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from ..stopwatch import Span, Stopwatch
from .case import Place, Running
from .files import load_case

# What libraries read when they are loaded, to know how many threads to start.
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENMM_CPU_THREADS")


class Failed(Exception):
    """An entry could not go on; says why."""


class Worker:
    """An entry under way in a process of its own.

    Args:
        path: The case's file.
        options: Of the case.
        name: The entry's.
        place: What it may use.

    Raises:
        Failed: It could not be made.
    """

    def __init__(self, path: Path, options: Mapping[str, Any], name: str, place: Place):
        context = multiprocessing.get_context("spawn")
        self._pipe, other = context.Pipe()
        self._process = context.Process(
            target=_serve, args=(other, path, dict(options), name, place), daemon=True
        )
        with _confined(place.threads):
            self._process.start()
        other.close()
        self.work, self.particles = self._answer()

    def advance(self) -> Span:
        """What a block took."""
        return self._ask("advance")

    def answers(self) -> dict[str, float]:
        """The entry's answers."""
        return self._ask("answers")

    def memory(self) -> float:
        """Bytes that the process holds beyond those that it had before the entry was made."""
        return self._ask("memory")

    def close(self) -> None:
        """End the process."""
        self._pipe.close()
        self._process.join(2)
        self._process.kill()
        self._process.join()

    def _ask(self, what: str) -> Any:
        self._pipe.send(what)
        return self._answer()

    def _answer(self) -> Any:
        try:
            answer = self._pipe.recv()
        except EOFError:
            self._process.join(10)
            raise Failed(f"ended with exit code {self._process.exitcode}") from None
        if isinstance(answer, Failed):
            raise answer
        return answer


def _serve(pipe: Connection, path: Path, options: dict[str, Any], name: str, place: Place) -> None:
    """The process: make the entry, then do what is asked."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):  # many programs talk
        os.dup2(nowhere, stream)
    try:
        case = load_case(path, options)
        before = _memory()
        running = {**case.ours, **case.peers}[name].start(place)
        pipe.send((running.work, running.particles))
        while True:
            what = pipe.recv()
            if what == "advance":
                pipe.send(_timed(running))
            elif what == "answers":
                pipe.send({key: float(value) for key, value in running.answers().items()})
            else:
                gc.collect()
                pipe.send(_memory() - before)
    except EOFError:  # nobody asks any more
        return
    except BaseException as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{os.path.basename(last.filename)}, line {last.lineno}"
        pipe.send(Failed(f"{type(error).__name__}: {error} ({where})"))


def _timed(running: Running) -> Span:
    watch = Stopwatch()
    own = running.advance()
    span = watch.read()
    return span if own is None else replace(span, wall=own)


@contextlib.contextmanager
def _confined(threads: int) -> Iterator[None]:
    """Processes that are started inside have so many cores: the last, the first serve others."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, str(threads)))
    bound = hasattr(os, "sched_setaffinity")
    cores = os.sched_getaffinity(0) if bound else set()
    try:
        if bound:
            os.sched_setaffinity(0, sorted(cores)[-threads:])
        yield
    finally:
        if bound:
            os.sched_setaffinity(0, cores)
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _memory() -> float:
    """Bytes of memory that this process holds; nan where the system does not tell."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:
        return float("nan")
    return float(pages * os.sysconf("SC_PAGE_SIZE"))
