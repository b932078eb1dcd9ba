"""Stopwatch: what frames cost on a machine that does other things too.

A run of the same settings does the same work every time, block of frames by block of frames. So of
each block those passes count in which the system did not take the processor away, and what the
others took longer is left out.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import warp as wp

try:
    import resource
except ImportError:  # not on Windows: there no pass is known to be disturbed
    resource = None  # type: ignore[assignment]

BLOCK = 1e-3  # seconds of a block: less than a slice of time that the system gives away


@dataclass
class Pass:
    """One pass over the frames: of each block wall and CPU seconds, and whether it was disturbed.

    CPU seconds are those of all threads of the process.
    """

    wall: list[float] = field(default_factory=list)
    cpu: list[float] = field(default_factory=list)
    disturbed: list[bool] = field(default_factory=list)
    frames: int = 0

    def time(self, sim: Any, frames: int) -> None:
        """Advance by a block of frames."""
        wp.synchronize_device(sim.device)
        switches, cpu, wall = _switches(), time.process_time(), time.perf_counter()
        for _ in range(frames):
            sim.step()
        wp.synchronize_device(sim.device)
        self.wall.append(time.perf_counter() - wall)
        self.cpu.append(time.process_time() - cpu)
        self.disturbed.append(_switches() != switches)
        self.frames += frames


def _switches() -> int:
    """How often a thread of this process had to give its processor away."""
    return 0 if resource is None else resource.getrusage(resource.RUSAGE_SELF).ru_nivcsw


def undisturbed(own: list[Pass], every: list[Pass]) -> tuple[float, float]:
    """Wall and CPU seconds of a pass, as if nothing had disturbed it.

    Of each block the median of its undisturbed times: of the passes ``own``, else of ``every``.
    Where there are none, it is the CPU time, of which threads at work at once share the wall.
    """
    blocks = min(len(each.wall) for each in every)
    wall, cpu = np.zeros(blocks), np.zeros(blocks)
    missing = []
    for k in range(blocks):
        for passes in (own, every):
            good = [each for each in passes if not each.disturbed[k]]
            if good:
                wall[k] = np.median([each.wall[k] for each in good])
                cpu[k] = np.median([each.cpu[k] for each in good])
                break
        else:
            cpu[k] = np.median([each.cpu[k] for each in own])
            missing.append(k)
    if missing:
        ratios = [w / c for each in every for w, c in zip(each.wall, each.cpu, strict=True) if c]
        wall[missing] = cpu[missing] * min([1.0, *ratios])
    return float(wall.sum()), float(cpu.sum())
