"""Progress of a run: a bar on a terminal, the rate, and a summary."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from typing import Any


class Meter:
    """Counts frames and measures their rate."""

    def __init__(self) -> None:
        self.done = 0
        self.label, self.frames, self.particles, self.work = "", 0, 0, 0
        self.started = self.first = self.last = 0.0

    @contextlib.contextmanager
    def measure(self, label: str, sim: Any, frames: int) -> Iterator[Callable[[int, int], None]]:
        """Show a bar while the simulation runs; yields what it calls after every frame."""
        self.label, self.frames, self.particles = label, frames, sim.particle_count
        self.work = self.particles * sim.settings.substeps
        self.started = time.perf_counter()
        with _progress("frames", "{task.fields[detail]}") as bar:
            count = f"{self.particles:,} particles"
            task = bar.add_task(f"{label}: compiling", total=frames, detail=count)

            def after_frame(frame: int, frames: int) -> None:
                self.done += 1
                self.last = time.perf_counter()
                self.first = self.first or self.last
                detail = f"{count}, {self.rate()}"
                bar.update(task, completed=frame, description=label, detail=detail)

            yield after_frame

    def rate(self) -> str:
        """Particle-substeps a second; without the first frame, if there are others: it compiles."""
        frames, since = (self.done - 1, self.first) if self.done > 1 else (1, self.started)
        rate = frames * self.work / max(self.last - since, 1e-9)
        for limit, prefix in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
            if rate >= limit:
                return f"{rate / limit:.3g} {prefix} particle-substeps/s"
        return f"{rate:.3g} particle-substeps/s"

    def summary(self) -> str:
        """What was done, and how fast."""
        seconds = time.perf_counter() - self.started
        return (
            f"{self.label}: {self.done} frames of {self.particles:,} particles in "
            f"{seconds:.3g} s, {self.rate()}"
        )


@contextlib.contextmanager
def bar(label: str, unit: str) -> Iterator[Callable[[int, int, str], None]]:
    """Show a bar on a terminal; yields what is called with (done, total, what is being done)."""
    with _progress(unit) as progress:
        task = progress.add_task(f"{label}: compiling", total=None)

        def show(done: int, total: int, doing: str) -> None:
            progress.update(task, completed=done, total=total, description=f"{label}: {doing}")

        yield show


@contextlib.contextmanager
def _progress(*texts: str) -> Iterator[Any]:
    """A line on a terminal: what is done, a bar, texts, and when it will be over."""
    from rich import progress
    from rich.console import Console

    name, *columns = (
        progress.TextColumn(text, markup=False) for text in ("{task.description}", *texts)
    )
    counted = [name, progress.BarColumn(), progress.MofNCompleteColumn(), *columns]
    console = Console(stderr=True)
    with progress.Progress(
        *counted, progress.TimeRemainingColumn(), console=console, disable=not console.is_terminal
    ) as shown:
        yield shown
