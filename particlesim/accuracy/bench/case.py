"""Cases: what is raced, in which unit it counts, and by which answers it is checked."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import warp as wp


@dataclass(frozen=True)
class Place:
    """What an entry may use.

    Args:
        threads: Cores, all of a CPU's work together.
        device: Of the simulations: ``"cpu"`` or ``"cuda:0"``. Other programs stay on the CPU.
    """

    threads: int
    device: str


class Running:
    """Something under way: made once, advanced block by block, and asked for its answers.

    ``work`` is how many units of the case a block is; ``particles`` how many there are, if a
    memory for each makes sense.
    """

    work: float = 1.0
    particles: int = 0

    def advance(self) -> float | None:
        """Do a block and wait for its end; seconds, from who has a clock of his own."""
        raise NotImplementedError

    def answers(self) -> dict[str, float]:
        """Numbers that everybody in the race must agree in, at the end of it."""
        return {}


@dataclass(frozen=True)
class Entry:
    """A simulation or another program in the race.

    Args:
        start: Makes it, in a process of its own that has the cores of ``place`` and no others.
        precision: In words: ``"float32"``, ``"mixed"``.
        needs: Python package or program without which it cannot run.
    """

    start: Callable[[Place], Running]
    precision: str = "float32"
    needs: str = ""

    @property
    def there(self) -> bool:
        """Whether what it needs is installed."""
        if not self.needs:
            return True
        return bool(shutil.which(self.needs) or importlib.util.find_spec(self.needs))


@dataclass(frozen=True, kw_only=True)
class Case:
    """A race on the same work.

    Args:
        title: What everybody does, with its sizes.
        unit: What a second has so many of: ``"atom-steps"``.
        ours: Simulations by name; the first is the one that others are compared with.
        peers: Other programs by name.
        agree: Relative difference from the first that is allowed, by the answer's name. Everybody
            has done the same blocks when he is asked.
        warm: Blocks before the first that is timed.
        repeats: Timed blocks.
    """

    title: str
    unit: str
    ours: Mapping[str, Entry]
    peers: Mapping[str, Entry] = field(default_factory=dict)
    agree: Mapping[str, float] = field(default_factory=dict)
    warm: int = 3
    repeats: int = 7


class Simulated(Running):
    """A simulation; a block is so many frames.

    Args:
        sim: A ``ps.Simulation``.
        frames: Of a block.
        answers: What it is asked at the end.
        work: Units of a block; None: particle-substeps.
    """

    def __init__(
        self,
        sim: Any,
        frames: int = 1,
        answers: Callable[[Any], dict[str, float]] = lambda sim: {},
        work: float | None = None,
    ):
        self.sim, self.frames, self._answers = sim, frames, answers
        self.particles = sim.particle_count
        self.work = frames * sim.settings.substeps * sim.particle_count if work is None else work

    def advance(self) -> None:
        for _ in range(self.frames):
            self.sim.step()
        wp.synchronize_device(self.sim.device)

    def answers(self) -> dict[str, float]:
        return self._answers(self.sim)


class Command(Running):
    """A whole process, from its start to its end; a block is one.

    Args:
        words: The command.
        cold: Give it an empty kernel cache each time.
    """

    def __init__(self, words: Sequence[str], cold: bool = False):
        self.words, self.cold = list(words), cold

    def advance(self) -> None:
        with tempfile.TemporaryDirectory() as empty:
            cache = {"WARP_CACHE_PATH": empty} if self.cold else {}
            subprocess.run(
                self.words, env={**os.environ, **cache}, cwd=empty, check=True, capture_output=True
            )
