"""Writing beside the simulation: the next frame computes while the last one is written."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

from .. import files

DEPTH = 2  # jobs at once: one being done, and one that waits


class BackgroundWriter(files.Closing):
    """Does jobs one after the other on a thread of its own.

    At most ``DEPTH`` are on their way, so that memory stays bounded; who hands out another waits.
    When a job fails, those after it are left out: nothing is written behind a gap.

    Example:
        >>> done = []
        >>> with BackgroundWriter() as writer:
        ...     for frame in range(3):
        ...         writer.put(lambda frame=frame: done.append(frame))
        >>> done
        [0, 1, 2]
    """

    def __init__(self) -> None:
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="particlesim-writer")
        self._pending: deque[Future[None]] = deque()
        self._failed = False

    def make_room(self) -> None:
        """Wait until another job may come.

        Raises:
            Exception: What an earlier job raised; once.
        """
        self._wait(DEPTH - 1)

    def put(self, job: Callable[[], Any]) -> None:
        """Hand out a job; raises as :meth:`make_room` does."""
        self.make_room()
        self._pending.append(self._pool.submit(self._do, job))

    def close(self) -> None:
        """Wait for all jobs, and raise what one of them raised. May be called again."""
        try:
            self._wait(0)
        finally:
            self._pool.shutdown()

    def _do(self, job: Callable[[], Any]) -> None:
        if self._failed:
            return
        try:
            job()
        except BaseException:
            self._failed = True
            raise

    def _wait(self, most: int) -> None:
        """Until ``most`` jobs are left; errors of those that are done come out here."""
        while self._pending and (len(self._pending) > most or self._pending[0].done()):
            self._pending.popleft().result()
