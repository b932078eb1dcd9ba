"""Running many frames: recording and progress around every step."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

from .. import validate
from ..instruments.watchdog.incident import SimulationError
from ..output import files
from ..output.history.writer import SUFFIXES, History
from ..output.interrupts import Deferred
from ..output.lock import Lock, lock_path
from ..output.progress import Meter
from ..output.recorders import open_recorder, recorder_class
from ..output.recorders.background import BackgroundWriter
from ..output.recorders.base import Recorder
from .reading import Reading
from .resume import OWNER, Checkpoints


def run(
    sim: Reading, step: Callable[[], None], frames: int, *, record: Any,
    progress: bool | Callable[[int, int], None], history: Any, observe: Any,
    overwrite: bool, resume: bool, **options: Any,
) -> None:  # fmt: skip
    """Advance by ``frames`` frames (see :meth:`Simulation.run`)."""
    first = sim.frame
    # What cannot be is told before anything is made.
    if record is not None:
        recorder_class(record)
    if history is not None:
        files.check_new("History", history, overwrite or resume, suffixes=SUFFIXES)
    with contextlib.ExitStack() as stack:
        recording = measured = None
        # Around the locks: none is left behind by who is ended between taking and holding it.
        interrupts = stack.enter_context(Deferred())
        locks: dict[Path, Lock] = {}
        for argument, path in (("record", record), ("history", history)):
            if path is not None and lock_path(Path(path)) not in locks:
                lock = stack.enter_context(Lock(OWNER, Path(path), argument))
                locks[lock.path] = lock
        if record is not None:
            options = {"overwrite": overwrite, "resume": resume, **options}
            lock = locks[lock_path(Path(record))]
            # First of all: a run that is resumed moves on to its checkpoint.
            recording = stack.enter_context(Recording(sim, frames, lock, interrupts, **options))
            interrupts.check()
        else:
            _refuse_without_record({"resume": resume, **options})
        if history is not None:
            measured = stack.enter_context(
                History(sim, history, overwrite=overwrite, resume=resume, observe=observe)
            )
            measured.write()
            if recording is not None:
                recording.beside = measured
        if progress is True:
            progress = stack.enter_context(Meter().measure("run", sim, frames))
        while sim.frame < first + frames:
            step()
            if recording is not None:
                recording.frame()
            if measured is not None:
                measured.write()
            if callable(progress):
                progress(sim.frame - first, frames)
            interrupts.check()


class Recording:
    """A run's output and checkpoints, written beside the simulation.

    Making one records the present frame; or, where there is something to resume, moves the
    simulation on to where that ends.

    Args:
        sim: The simulation, at the start of the run.
        frames: Of the whole run.
        lock: Held on the output, whose path it knows.
        interrupts: What keeps ends that are asked for until a frame is done.
        overwrite: Replace an existing output.
        checkpoint: Frames from one checkpoint to the next, 0 for none; None: by the clock.
        resume: Go on with what is there.
        **options: Of the recorder.
    """

    def __init__(
        self, sim: Reading, frames: int, lock: Lock, interrupts: Deferred, *,
        overwrite: bool = False, checkpoint: int | None = None, resume: bool = False,
        **options: Any,
    ):  # fmt: skip
        self.sim, self.lock, self.interrupts, path = sim, lock, interrupts, lock.output
        _check(overwrite, checkpoint, resume)
        first, end = sim.frame, sim.frame + frames
        self.checkpoints = None
        self.recorded: int | None = None
        self.beside: History | None = None  # what else has to be there for a checkpoint
        if checkpoint != 0:
            self.checkpoints = Checkpoints(sim, path, checkpoint, options)
            if resume:
                # With nothing recorded for certain, what is there is a start to be made again.
                self.recorded = self.checkpoints.resume()
                overwrite = self.checkpoints.path.exists()
        self.recorder: Recorder = open_recorder(
            sim, path, frames=max(0, end - sim.frame), overwrite=overwrite,
            resume=self.recorded, **options,
        )  # fmt: skip
        self.recorder.locked = True  # by the run
        self.background = BackgroundWriter()
        if self.checkpoints is not None and self.recorded is None and sim.frame == first:
            self.checkpoints.start(overwrite)
        if self.recorded is None:
            self.frame()

    def frame(self) -> None:
        """Record the present frame, if that is to be, and make a checkpoint when one is due.

        Raises:
            Exception: What the writing of an earlier frame raised.
        """
        self.background.make_room()
        captured = self.recorder.capture()
        if captured is not None:
            self.recorded = captured.number
            self.background.put(lambda: self._write(captured))
        if self.checkpoints is not None and self.checkpoints.due():
            self.background.put(self._checkpoint())

    def _write(self, captured: Any) -> None:
        self.recorder.write_frame(captured)
        self.lock.reserve(self.recorder.rest)

    def _checkpoint(self) -> Callable[[], None]:
        assert self.checkpoints is not None
        return self.checkpoints.capture(self.recorded, self._sync)

    def _sync(self) -> None:
        """Return only when the disk has what a checkpoint claims."""
        self.recorder.sync()
        if self.beside is not None:
            self.beside.sync()

    def close(self) -> None:
        """Write what has been captured, the end of the output, and the state to go on from."""
        self.background.close()
        self.lock.free()
        self.recorder.close()
        if self.checkpoints is not None and not self.checkpoints.complete:
            self._checkpoint()()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> None:
        if error is None:
            self.close()
            return
        # Finished frames are kept; the first error is the one to see.
        with contextlib.suppress(Exception):
            self.background.close()
            # The state is that of the last good frame, or of the one after which an end was asked.
            whole = isinstance(error, SimulationError) or self.interrupts.acted
            if whole and self.checkpoints is not None and not self.checkpoints.complete:
                self._checkpoint()()
        self.lock.free()  # there may be no other room
        with contextlib.suppress(Exception):
            self.recorder.close()


def _check(overwrite: bool, checkpoint: int | None, resume: bool) -> None:
    if checkpoint is not None:
        validate.whole(OWNER, "checkpoint", checkpoint)
    if resume and overwrite:
        raise validate.fail(
            OWNER, "resume", "come without overwrite", resume, "go on, or start anew"
        )
    if resume and checkpoint == 0:
        raise validate.fail(
            OWNER, "checkpoint", "be above 0 where a run is resumed", checkpoint, "leave it out"
        )


def _refuse_without_record(options: dict[str, Any]) -> None:
    """Without an output there is nothing that these could be about."""
    for name, value in options.items():
        if name != "fields" and value not in (None, False):
            raise validate.fail(OWNER, "record", f"be given where {name} is", None, "name a file")
