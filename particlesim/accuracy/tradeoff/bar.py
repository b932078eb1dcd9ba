"""Progress of a sweep: a bar on a terminal."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

from ...output import progress


@contextlib.contextmanager
def bar(label: str) -> Iterator[Callable[[int, int], None]]:
    """Show a bar; yields what is called with the frames done and all there are."""
    with progress.bar(label, "frames") as show:
        yield lambda done, total: show(done, total, "reference" if done == total else "sweep")
