"""Crew: runs kernels on a device, on the CPU by several threads."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import warp as wp

from ..executors import available_threads
from ..launch import Launch

CHUNKS_PER_THREAD = 16  # so that a thread that is held up does not hold up the others


class Crew:
    """Runs launches one after the other, each cut into chunks where there are threads.

    A launch of a picture takes milliseconds, so that Python's own threads do; those of the
    simulation are for launches of microseconds.

    Args:
        device: Warp's name of a device; None: CUDA where there is one, else the CPU.
        threads: Of the CPU; None: as many as there are cores.
    """

    def __init__(self, device: Any = None, threads: int | None = None):
        self.device = wp.get_device(device)
        self.threads = (threads or available_threads()) if self.device.is_cpu else 1
        self._pool = ThreadPoolExecutor(self.threads) if self.threads > 1 else None

    def launch(self, kernel: Any, dim: int, inputs: Sequence[Any]) -> None:
        """Run ``kernel`` over ``dim`` rows; on the CPU it is done on return."""
        if dim == 0:
            return
        operation = Launch(kernel, dim, inputs, self.device)
        if self._pool is None:
            operation.issue()
            return
        # Recorded here: Warp compiles on one thread. It lets go of Python's lock while it runs.
        commands = operation.record(self.threads * CHUNKS_PER_THREAD)
        for done in [self._pool.submit(command.launch) for command in commands]:
            done.result()

    def array(self, values: Any, dtype: Any) -> wp.array:
        """A NumPy array on the device; on the CPU the same memory."""
        return wp.array(values, dtype=dtype, device=self.device, copy=not self.device.is_cpu)

    def empty(self, shape: Any, dtype: Any) -> wp.array:
        """Memory on the device."""
        return wp.empty(shape, dtype=dtype, device=self.device)

    def close(self) -> None:
        """End the threads."""
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None
