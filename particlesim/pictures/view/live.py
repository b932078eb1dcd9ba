"""A running scene as footage: a thread steps it and records it into a folder of its own."""

from __future__ import annotations

import tempfile
import threading
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from ...engine.source import Runner
from ...output.usd.recorder import UsdRecorder
from ...output.usd.writing.writer import UsdWriter
from .footage import Footage


class Live:
    """A simulation that runs while it is watched.

    Only its own thread touches the simulation. What is done can be looked at again.

    Args:
        sim: The simulation; it belongs to the view until that is closed.
        frames: How many frames to run.
        fields: Names of further values to record, to colour by.
        title: What the page calls it.
    """

    def __init__(self, sim: Runner, frames: int, fields: Iterable[str] = (), title: str = ""):
        self.sim, self.frames, self.fields, self.title = sim, frames, tuple(fields), title
        self.take, self.done, self.playing = 0, 0, False
        self.error: str | None = None
        self._folder = tempfile.TemporaryDirectory(
            prefix="particlesim-", ignore_cleanup_errors=True
        )
        self._last: UsdWriter | None = None  # of the take before
        self._wake = threading.Condition()
        self._rewinding = self._closing = False
        try:
            self._begin()
        except BaseException:
            self._folder.cleanup()
            raise
        self._thread = threading.Thread(target=self._work, name="particlesim-live", daemon=True)
        self._thread.start()

    def play(self) -> None:
        """Go on computing, up to the last frame."""
        with self._wake:
            self.playing = self.error is None
            self._wake.notify_all()

    def pause(self) -> None:
        """Compute no further frame."""
        with self._wake:
            self.playing = False

    def reset(self) -> None:
        """Back to the start, at rest; returns when it is there."""
        with self._wake:
            self.playing, self._rewinding = False, True
            self._wake.notify_all()
            self._wake.wait_for(lambda: not self._rewinding or self._closing)

    def state(self) -> dict[str, Any]:
        """What the page shows of it."""
        return {
            "playing": self.playing and self.done < self.frames,
            "done": self.done,
            "planned": self.frames,
            "error": self.error,
        }

    def close(self) -> None:
        """End the thread, and remove what it has recorded."""
        with self._wake:
            self._closing = True
            self._wake.notify_all()
        self._thread.join()
        self._folder.cleanup()

    def _begin(self) -> None:
        """Record the present state as the first frame of a new take.

        Recorders are not closed: nobody reads the end that a file has.
        """
        path = Path(self._folder.name) / f"take_{self.take}.usda"
        self._recorder = UsdRecorder(
            self.sim, path, frames=self.frames, fields=self.fields,
            layout="grid" if self.sim.model.world_count > 1 else None,
        )  # fmt: skip
        self._recorder.write()
        self.footage = Footage(path)
        self.footage.take = self.take
        self.done = 0

    def _work(self) -> None:
        while True:
            with self._wake:
                self._wake.wait_for(self._has_work)
                if self._closing:
                    return
            try:
                if self._rewinding:
                    self._rewind()
                else:
                    self.sim.step()
                    self._recorder.write()
                    self.done += 1
            except Exception as error:  # the page says it, and everything done can be looked at
                with self._wake:
                    self.error = " ".join(str(error).split()) or type(error).__name__
                    self.playing = self._rewinding = False
                    self._wake.notify_all()

    def _has_work(self) -> bool:
        return self._closing or self._rewinding or (self.playing and self.done < self.frames)

    def _rewind(self) -> None:
        old = self._recorder
        self.sim.reset()
        self.take += 1
        self._begin()
        # The take before may still be being read; it goes the next time.
        if self._last is not None:
            for file in [*self._last.clips.glob("*"), self._last.path]:
                file.unlink(missing_ok=True)
        self._last = old.writer
        with self._wake:
            self.error, self._rewinding = None, False
            self._wake.notify_all()
