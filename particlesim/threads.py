"""A team of threads that share recorded launches.

Between two shared launches lie tens of microseconds, and waking a thread that sleeps takes
hundreds. So a thread that has run out of work looks for more in native code for about a
millisecond, without Python's lock, before it goes to sleep.
"""

from __future__ import annotations

import threading
from typing import Any

import warp as wp

from .kernels.wait import wait_kernel

# A worker looks for work for about a millisecond. Who waits for the workers sleeps much sooner: on
# a machine with other work to do, it may be in the way of the very one that it waits for.
LOOKS_FOR_WORK, LOOKS_FOR_WORKERS = 1_000_000, 50_000


class Team:
    """The calling thread and ``threads - 1`` workers.

    Args:
        threads: Threads in all, at least 2.
    """

    def __init__(self, threads: int):
        self._board = _Board(threads - 1)
        # The workers know the board only, so that the team can be let go.
        self.workers = [
            threading.Thread(target=_work, args=(self._board, index), daemon=True)
            for index in range(threads - 1)
        ]
        for worker in self.workers:
            worker.start()

    def run(self, commands: list[Any]) -> None:
        """Launch all commands, each by whoever is free, and return when all are done."""
        board = self._board
        board.todo = list(commands)
        board.post()
        failure = _drain(board.todo)
        board.wait_for_all()
        failure = board.failure or failure
        if failure is not None:
            board.failure = None
            raise failure

    def close(self) -> None:
        """Send the workers home."""
        self._board.closed = True
        self._board.post()

    def __del__(self) -> None:
        self.close()


class _Waiter:
    """Waits for a counter in memory to change, in native code."""

    def __init__(self, counter: wp.array, looks: int):
        self.counter, self.view = counter, counter.numpy()
        self.command = wp.launch(
            wait_kernel(), 1, [0, counter, 0, looks], device="cpu", record_cmd=True
        )

    def wait(self, value: int) -> bool:
        """Look until the counter is no longer ``value``; False if it still is."""
        self.command.set_param_at_index(2, value)
        self.command.launch()
        return bool(self.view[0] != value)


class _Board:
    """What a team shares: the commands, how often some were posted, and who has finished."""

    def __init__(self, workers: int):
        self.todo: list[Any] = []
        self.failure: Exception | None = None
        self.closed = False
        self.posted = wp.zeros(1, dtype=wp.int32, device="cpu")
        self.posts = self.posted.numpy()
        self.done = [wp.zeros(1, dtype=wp.int32, device="cpu") for _ in range(workers)]
        self.counts = [each.numpy() for each in self.done]
        self.waiters = [_Waiter(each, LOOKS_FOR_WORKERS) for each in self.done]
        self.awake = threading.Condition()
        self.caller_sleeps = False

    def post(self) -> None:
        """Tell everybody, those asleep too."""
        with self.awake:
            self.posts[0] += 1
            self.awake.notify_all()

    def wait_for_all(self) -> None:
        """Until each worker has finished with the latest post."""
        latest = int(self.posts[0])
        for waiter in self.waiters:
            if waiter.view[0] == latest or waiter.wait(int(waiter.view[0])):
                continue
            with self.awake:
                self.caller_sleeps = True
                while waiter.view[0] != latest:
                    self.awake.wait()
                self.caller_sleeps = False

    def finish(self, index: int, post: int) -> None:
        """A worker has nothing left to do of a post."""
        self.counts[index][0] = post
        if self.caller_sleeps:
            with self.awake:
                self.awake.notify_all()


def _work(board: _Board, index: int) -> None:
    waiter, seen = _Waiter(board.posted, LOOKS_FOR_WORK), 0
    while True:
        if not waiter.wait(seen):
            with board.awake:
                while board.posts[0] == seen:
                    board.awake.wait()
        seen = int(board.posts[0])
        if board.closed:
            return
        board.failure = _drain(board.todo) or board.failure
        board.finish(index, seen)


def _drain(todo: list[Any]) -> Exception | None:
    """Run commands off the shared list until it is empty; list.pop is atomic."""
    try:
        while True:
            todo.pop().launch()
    except IndexError:
        return None
    except Exception as failure:
        return failure
