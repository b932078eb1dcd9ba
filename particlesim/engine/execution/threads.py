"""A team of threads that share chains of launches (see :mod:`particlesim.kernels.engine.team`).

Between two shared launches lie tens of microseconds, and waking a thread that sleeps takes
hundreds. So a worker looks for the next launch in native code for some milliseconds before it goes
to sleep.
"""

from __future__ import annotations

import functools
import itertools
import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import warp as wp

from ...kernels.engine.team import LEAVE, LEFT, POSTS, RING, STAGE, serve_kernel, share_kernel
from ...kernels.self_check import fast_ways
from ...kernels.warp_internals import Packed

# A worker looks for work for about five milliseconds. The caller, who waits for the workers, looks
# for a shorter while and then lets others run: one of them may be the worker that it waits for.
WORKER_LOOKS, CALLER_LOOKS = 10_000_000, 100_000


class Chain:
    """Launches that follow one another, one stage each.

    Args:
        stages: ``wp.Launch`` commands on the CPU, a list for each stage: the chunks of a launch.
    """

    def __init__(self, stages: Sequence[Sequence[Any]]):
        self.stages = stages

    @functools.cached_property
    def table(self) -> np.ndarray:
        """For native code: the address of each stage's packed chunks, and their number."""
        self._packed = [[Packed(command) for command in stage] for stage in self.stages]
        self._chunks = [
            np.array([each.addresses for each in packed], dtype=np.uint64)
            for packed in self._packed
        ]
        table = [(chunks.ctypes.data, len(chunks)) for chunks in self._chunks]
        return np.array(table, dtype=np.uint64)


class Team:
    """The calling thread and ``threads - 1`` workers; the former alone where Warp has changed.

    Args:
        threads: Threads in all, at least 1.
    """

    def __init__(self, threads: int):
        self.workers: list[threading.Thread] = []
        self._board = _Board() if fast_ways() else None
        if self._board is None:
            return
        self._share = self._board.action(share_kernel(), CALLER_LOOKS, back=False)
        # Recorded here: Warp compiles on one thread. The workers know the board only, so that the
        # team can be let go.
        serves = [
            self._board.action(serve_kernel(), WORKER_LOOKS, back=index % 2 == 0)
            for index in range(threads - 1)
        ]
        self.workers = [
            threading.Thread(target=_work, args=(self._board, serve), daemon=True)
            for serve in serves
        ]
        for worker in self.workers:
            worker.start()

    def run(self, chain: Chain) -> None:
        """Run all stages in turn, each by whoever is free, and return when all are done."""
        if self._board is None:
            for command in itertools.chain(*chain.stages):
                command.launch()
            return
        self._board.offer(chain)
        words = self._board.words
        try:
            self._finish(words)
        except BaseException:  # an interrupt: no chunk may be under way when the next chain comes
            self._finish(words)
            raise

    def _finish(self, words: np.ndarray) -> None:
        share = self._share
        share()
        while words[LEFT]:
            time.sleep(0)
            share()

    def close(self) -> None:
        """Send the workers home."""
        if self._board is not None:
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

    def action(self, kernel: Any, looks: int, back: bool) -> Callable[[], None]:
        """One of the team's kernels as a function; chunks are taken from front or back."""
        inputs = [0, self.memory, looks, int(back)]
        command = wp.launch(kernel, 1, inputs, device="cpu", record_cmd=True)
        return Packed(command).function()

    def offer(self, chain: Chain) -> None:
        """Lay out the stages; nothing of an earlier chain is still under way."""
        self.posts += 1
        self.words[STAGE], self.words[LEFT] = chain.table.ctypes.data, len(chain.table)
        if self.asleep:
            with self.awake:
                self.awake.notify_all()

    def close(self) -> None:
        """Have everybody leave."""
        self.words[LEAVE] = 1
        with self.awake:
            self.awake.notify_all()


def _work(board: _Board, serve: Callable[[], None]) -> None:
    while not board.words[LEAVE]:
        serve()
        with board.awake:
            seen = board.posts
            board.asleep += 1
            # What is posted from here on finds this worker counted as asleep, and wakes it.
            if board.posts == seen and not board.words[LEAVE]:
                board.awake.wait()
            board.asleep -= 1
