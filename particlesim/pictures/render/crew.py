"""Crew: runs kernels on a device, on the CPU by several threads."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import warp as wp

from ...engine.execution.executors import available_threads
from ...engine.execution.launch import Launch
from ...engine.execution.threads import Chain, Team

CHUNKS_PER_THREAD = 16  # so that a thread that is held up does not hold up the others
LEAST = 16  # rows of a chunk: a tile of the picture is much work


class Crew:
    """Runs launches one after the other, each cut into chunks where there are threads.

    Args:
        device: Warp's name of a device; None: CUDA where there is one, else the CPU.
        threads: Of the CPU; None: as many as there are cores.
    """

    def __init__(self, device: Any = None, threads: int | None = None):
        self.device = wp.get_device(device)
        self.threads = (threads or available_threads()) if self.device.is_cpu else 1
        self._kept: dict[str, wp.array] = {}
        self._team = Team(self.threads) if self.threads > 1 else None

    def launch(self, kernel: Any, dim: int, inputs: Sequence[Any]) -> None:
        """Run ``kernel`` over ``dim`` rows; on the CPU it is done on return."""
        if dim == 0:
            return
        operation = Launch(kernel, dim, inputs, self.device)
        if self._team is None:
            operation.issue()
            return
        self._team.run(Chain([operation.record(self.threads * CHUNKS_PER_THREAD, LEAST)]))

    def array(self, values: Any, dtype: Any) -> wp.array:
        """A NumPy array on the device; on the CPU the same memory."""
        return wp.array(values, dtype=dtype, device=self.device, copy=not self.device.is_cpu)

    def empty(self, shape: Any, dtype: Any) -> wp.array:
        """Memory on the device."""
        return wp.empty(shape, dtype=dtype, device=self.device)

    def kept(self, name: str, shape: tuple[int, int], dtype: Any) -> wp.array:
        """Memory that the next picture of this size uses again: new memory costs its first use."""
        found = self._kept.get(name)
        if found is None or found.shape != shape or found.dtype != dtype:
            found = self._kept[name] = self.empty(shape, dtype)
        return found

    def close(self) -> None:
        """End the threads."""
        if self._team is not None:
            self._team.close()
            self._team = None
