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


@dataclass(frozen=True)
class Span:
    """What something took: wall seconds, CPU seconds of all threads and of ended child processes,
    and how often one of them had to give its processor away."""

    wall: float
    cpu: float
    switches: int


class Stopwatch:
    """Runs from when it is made."""

    def __init__(self) -> None:
        self._start = self._now()

    def read(self) -> Span:
        """The time since."""
        now, start = self._now(), self._start
        return Span(now.wall - start.wall, now.cpu - start.cpu, now.switches - start.switches)

    def _now(self) -> Span:
        cpu, switches = time.process_time(), 0
        if resource is not None:
            own, ended = (
                resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
            )
            cpu += ended.ru_utime + ended.ru_stime
            switches = own.ru_nivcsw + ended.ru_nivcsw
        return Span(time.perf_counter(), cpu, switches)


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
        watch = Stopwatch()
        for _ in range(frames):
            sim.step()
        wp.synchronize_device(sim.device)
        span = watch.read()
        self.wall.append(span.wall)
        self.cpu.append(span.cpu)
        self.disturbed.append(span.switches > 0)
        self.frames += frames


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
