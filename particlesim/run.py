"""Running many frames: recording and progress around ``Simulation.step``."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

from .progress import Meter
from .record import UsdRecorder

if TYPE_CHECKING:
    from .simulation import Simulation


def run(
    sim: Simulation,
    frames: int,
    *,
    record: Any,
    overwrite: bool,
    fields: Iterable[str],
    progress: bool | Callable[[int, int], None],
) -> None:
    """Advance ``sim`` by ``frames`` frames (see :meth:`Simulation.run`)."""
    with contextlib.ExitStack() as stack:
        recorder = None
        if record is not None:
            recorder = stack.enter_context(
                UsdRecorder(sim, record, frames=frames, fields=fields, overwrite=overwrite)
            )
            recorder.write()
        if progress is True:
            progress = stack.enter_context(Meter().measure("run", sim, frames))
        for frame in range(1, frames + 1):
            sim.step()
            if recorder is not None:
                recorder.write()
            if callable(progress):
                progress(frame, frames)
