"""A team of threads that share recorded launches (see :mod:`particlesim.kernels.team`).

Between two shared launches lie tens of microseconds, and waking a thread that sleeps takes
hundreds. So a worker looks for the next launch in native code for some milliseconds before it goes
to sleep.
"""

from __future__ import annotations

import ctypes
import threading
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from .kernels.team import COUNT, DONE, LEAVE, POSTS, RING, TABLE, serve_kernel, share_kernel

# A worker looks for work for about five milliseconds. The caller, who waits for the workers, looks
# for a shorter while and then lets others run: one of them may be the worker that it waits for.
WORKER_LOOKS, CALLER_LOOKS = 10_000_000, 100_000


class Shared:
    """Commands packed for native code: entry point, bounds and arguments of each.

    Args:
        commands: ``wp.Launch`` commands on the CPU.
    """

    def __init__(self, commands: Sequence[Any]):
        self._kept = [_packed(command) for command in commands]  # what the table points to
        self.table = np.array([addresses for addresses, _ in self._kept], dtype=np.uint64)
        self.count = len(self.table)


class Team:
    """The calling thread and ``threads - 1`` workers.

    Args:
        threads: Threads in all, at least 2.
    """

    def __init__(self, threads: int):
        self._board = _Board()
        self._share = self._board.command(share_kernel(), CALLER_LOOKS, back=False)
        # Recorded here: Warp compiles on one thread. The workers know the board only, so that the
        # team can be let go.
        serves = [
            self._board.command(serve_kernel(), WORKER_LOOKS, back=index % 2 == 0)
            for index in range(threads - 1)
        ]
        self.workers = [
            threading.Thread(target=_work, args=(self._board, serve), daemon=True)
            for serve in serves
        ]
        for worker in self.workers:
            worker.start()

    def run(self, shared: Shared) -> None:
        """Run all commands, each by whoever is free, and return when all are done."""
        board = self._board
        board.post(shared)
        self._share.launch()
        while board.words[DONE] < shared.count:
            time.sleep(0)
            self._share.launch()

    def close(self) -> None:
        """Send the workers home."""
        self._board.close()

    def __del__(self) -> None:
        self.close()


class _Board:
    """The shared memory, and where workers sleep."""

    def __init__(self) -> None:
        self.memory = wp.zeros(POSTS + RING, dtype=wp.uint64, device="cpu")
        self.words = self.memory.numpy()
        self.posts = 0
        self.asleep = 0
        self.awake = threading.Condition()

    def command(self, kernel: Any, looks: int, back: bool) -> Any:
        """A recorded launch of one of the team's kernels; chunks are taken from front or back."""
        inputs = [0, self.memory, looks, int(back)]
        return wp.launch(kernel, 1, inputs, device="cpu", record_cmd=True)

    def post(self, shared: Shared) -> None:
        """Offer the commands; nothing of an earlier post is still under way."""
        self.posts += 1
        self.words[TABLE], self.words[COUNT] = shared.table.ctypes.data, shared.count
        if self.asleep:
            with self.awake:
                self.awake.notify_all()

    def close(self) -> None:
        """Have everybody leave."""
        self.words[LEAVE] = 1
        with self.awake:
            self.awake.notify_all()


def _work(board: _Board, serve: Any) -> None:
    while not board.words[LEAVE]:
        serve.launch()
        with board.awake:
            seen = board.posts
            board.asleep += 1
            # What is posted from here on finds this worker counted as asleep, and wakes it.
            if board.posts == seen and not board.words[LEAVE]:
                board.awake.wait()
            board.asleep -= 1


def _packed(command: Any) -> tuple[tuple[int, int, int], Any]:
    """Addresses of a command's entry point, bounds and arguments, and what must live as long.

    A compiled CPU kernel is a function of two pointers: the bounds, and a struct of its arguments.
    """
    bounds, *values = command.params
    names = [argument.label for argument in command.kernel.adj.args]
    kinds = list(zip(names, map(type, values), strict=True))
    arguments = type("Arguments", (ctypes.Structure,), {"_fields_": kinds})(*values)
    entry = ctypes.cast(command.hooks.forward, ctypes.c_void_p).value or 0
    addresses = (entry, ctypes.addressof(bounds), ctypes.addressof(arguments))
    return addresses, (command, bounds, arguments)
