"""Progress of a run: a bar on a terminal or in a notebook, the rate, and a summary."""

from __future__ import annotations

import contextlib
import io
import time
from collections.abc import Callable, Iterator
from typing import Any

INTERVAL = 0.2  # seconds between two pictures of a bar in a notebook
WIDTH = 120  # of it, in letters


def label(source: Any) -> str:
    """What a module or a function of scenes is called in reports: without where it is from."""
    name = getattr(source, "__name__", "scene")
    return name.rpartition(".")[2].removeprefix("scene_")


class Meter:
    """Counts frames, or whatever is done one by one, and measures the rate of frames."""

    def __init__(self) -> None:
        self.done, self.frames, self.unit = 0, 0, "frames"
        self.label, self.particles, self.work = "", 0, 0
        self.started = self.first = self.last = 0.0

    @contextlib.contextmanager
    def measure(self, label: str, sim: Any, frames: int) -> Iterator[Callable[[int, int], None]]:
        """Show a bar while the simulation runs; yields what it calls after every frame."""
        self.label, self.frames, self.particles = label, frames, sim.particle_count
        self.started = time.perf_counter()
        count = f"{self.particles:,} particles"
        with bar(label, "frames", frames, count) as show:

            def after_frame(frame: int, frames: int) -> None:
                self.done += 1
                work = self.particles * sim.settings.substeps
                self.work = work if self.done <= 2 else self.work + work  # as of rate()
                self.last = time.perf_counter()
                self.first = self.first or self.last
                show(frame, frames, detail=f"{count}, {self.rate()}")

            yield after_frame

    @contextlib.contextmanager
    def count(
        self, label: str, unit: str = "frames", at_last: str = ""
    ) -> Iterator[Callable[..., None]]:
        """Show a bar; yields what is called with (done, all), and with what is being done.

        ``at_last``: what is being done when all are.
        """
        self.unit = unit
        with bar(label, unit) as show:

            def count(done: int, total: int, doing: str = "") -> None:
                self.done, self.frames = done, total
                show(done, total, doing or (at_last if done == total else ""))

            yield count

    def rate(self) -> str:
        """Particle-substeps a second; without the first frame, if there are others: it compiles."""
        since = self.first if self.done > 1 else self.started
        rate = self.work / max(self.last - since, 1e-9)
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
def bar(
    label: str, unit: str, total: int | None = None, detail: str = ""
) -> Iterator[Callable[..., None]]:
    """Show a bar on a terminal or in a notebook; yields ``show(done, total, doing, detail)``."""
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    columns = [
        TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(),
        TextColumn(unit), TextColumn("{task.fields[detail]}", markup=False), TimeRemainingColumn(),
    ]  # fmt: skip
    console = Console(stderr=True)
    hidden = not console.is_terminal
    with (
        Progress(*columns, console=console, disable=hidden) as progress,
        _in_notebook(progress, console.is_jupyter) as draw,
    ):
        task = progress.add_task(f"{label}: compiling", total=total, detail=detail)

        def show(done: int, total: int, doing: str = "", detail: str = "") -> None:
            words = f"{label}: {doing}" if doing else label
            progress.update(task, completed=done, total=total, description=words, detail=detail)
            draw(done == total)

        draw(True)
        yield show


@contextlib.contextmanager
def _in_notebook(progress: Any, there: bool) -> Iterator[Callable[[bool], None]]:
    """Yields what draws a bar in one place of a notebook's page, at once or if it is time to.

    Not by rich's own way, which asks for widgets, an extension that is often missing.
    """
    if not there:
        yield lambda at_once: None
        return
    from IPython.display import display
    from rich.console import Console

    shown: Any = None
    last = 0.0

    def draw(at_once: bool) -> None:
        nonlocal shown, last
        now = time.perf_counter()
        if not at_once and now - last < INTERVAL:
            return
        last = now
        console = Console(
            file=io.StringIO(), record=True, width=WIDTH, force_terminal=True, force_jupyter=False,
            color_system="truecolor",
        )  # fmt: skip
        console.print(progress.get_renderable())
        text = console.export_text(clear=False).strip()
        styled = console.export_html(inline_styles=True, code_format="<pre>{code}</pre>")
        content = {"text/plain": text, "text/html": styled}
        if shown is None:
            shown = display(content, raw=True, display_id=True)
        else:
            shown.update(content, raw=True)

    try:
        yield draw
    finally:
        draw(True)


@contextlib.contextmanager
def announced(words: str) -> Iterator[None]:
    """Show words on a terminal while something is under way, and take them away."""
    from rich.console import Console
    from rich.live import Live
    from rich.text import Text

    console = Console(stderr=True)
    if not console.is_terminal:
        yield
        return
    # Drawn once, not from a thread: what starts may itself be at work on the stream.
    with Live(Text(words), console=console, auto_refresh=False, transient=True):
        yield
