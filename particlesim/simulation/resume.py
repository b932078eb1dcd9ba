"""Going on with a recorded run that was ended: checkpoints beside its output.

``out.checkpoint.npz`` is there from before the first frame on. First it holds only what the run was
started with; then, now and again, the state too. Frames come before the checkpoint that follows
them, onto the disk itself, so that all frames up to a checkpoint are whole, after a loss of power
too. A run is resumed by calling it as it was called, with ``resume=True``: what was given is
compared with what is kept, bit by bit.
"""

from __future__ import annotations

import json
import time
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from .. import validate
from ..output import checkpoint
from ..scene.fingerprint import difference, fingerprint, first_change, values
from .reading import Reading

OWNER = "Simulation.run"
INTERVAL = 10.0  # least time between two checkpoints, where no number of frames is given [s]
SHARE = 0.02  # of the time that checkpoints may take
# Knobs that change the cost, and not one bit of the result.
FREE = ("execution", "threads")


def checkpoint_path(output: Path) -> Path:
    """Where the checkpoint of a recording is."""
    return output.with_suffix(".checkpoint.npz")


class Checkpoints:
    """The checkpoints of one recorded run.

    Args:
        sim: The simulation, at the start of the run.
        output: What it records to.
        every: Frames from one checkpoint to the next. None: by the clock, so that they take less
            than ``SHARE`` of the time.
        options: Of the recorder; a resumed run must have the same.
    """

    def __init__(self, sim: Reading, output: Path, every: int | None, options: Mapping):
        self.sim, self.output, self.every = sim, output, every
        self.path = checkpoint_path(output)
        self.first = sim.frame
        self._scenes = fingerprint(sim.scenes, sim.loop.laws)
        self._arguments = _plain(
            {
                "settings": {
                    name: value for name, value in sim.settings.plain.items() if name not in FREE
                },
                "device": "cpu" if sim.device.is_cpu else "cuda",
                "start": {"frame": sim.frame, "state": _checksum(sim)},
                "scenes": values(sim.scenes),
                "record": options,
            }
        )
        self._captured: int | None = None  # frame of the newest
        self._next = time.perf_counter() + INTERVAL
        self._writing = False

    def resume(self) -> int | None:
        """Put the simulation to where the newest checkpoint is.

        Returns:
            The last recorded frame that stays, None where there is none and nothing to go on from.

        Raises:
            FileExistsError: There is an output, and no checkpoint.
            ValueError: The run was started with something else.
        """
        if not self.path.exists():
            if self.output.exists():
                raise FileExistsError(
                    f"{OWNER}: record must have {self.path.name!r} beside it to be resumed, got "
                    f"{str(self.output)!r} without; choose another, or start anew with "
                    "overwrite=True."
                )
            return None
        saved = checkpoint.read(self.path)
        if "run" not in saved.header:
            raise validate.fail(
                OWNER, "record", "have the checkpoint of a recorded run beside it",
                str(self.path), "start anew with overwrite=True",
            )  # fmt: skip
        self._compare(saved.header)
        if saved.arrays:
            checkpoint.restore(self.sim.frames, self.sim.watchdog, saved)
            self._captured = self.sim.frame
        return saved.header["run"]["recorded"]

    def _compare(self, header: dict[str, Any]) -> None:
        saved = header["run"]["arguments"]
        changed = difference(header["scenes"], self._scenes)
        changed = changed or first_change("", saved, self._arguments)
        if changed:
            where, before, now = changed
            raise validate.fail(
                OWNER, where.lstrip("."), f"be as the run was started with, {before!r}"[:160], now,
                f"give the same to resume {str(self.output)!r}, or start anew with overwrite=True",
            )  # fmt: skip

    def start(self, overwrite: bool) -> None:
        """Write down what the run is started with, before its output is touched."""
        if self.path.exists() and not overwrite:
            raise FileExistsError(
                f"{OWNER}: record must be new, got {str(self.output)!r} where {self.path.name!r} "
                "exists; choose another, go on with resume=True, or pass overwrite=True."
            )
        checkpoint.write(self._capture(None, state=False), self.path)

    def due(self) -> bool:
        """Whether a checkpoint is to be made of the present frame."""
        if self._captured == self.sim.frame:
            return False
        if self.every is not None:
            return (self.sim.frame - self.first) % self.every == 0
        return not self._writing and time.perf_counter() >= self._next

    def capture(self, recorded: int | None, sync: Callable[[], None]) -> Callable[[], None]:
        """Copy the present state; what is returned writes it, on any thread.

        Args:
            recorded: The last frame that is recorded when the state is written.
            sync: Waits until the disk has that frame, and those before.
        """
        started = time.perf_counter()
        made = self._capture(recorded, state=True)
        self._captured = self.sim.frame
        spent = time.perf_counter() - started
        self._writing = True

        def write() -> None:
            started = time.perf_counter()
            sync()
            checkpoint.write(made, self.path)
            finished = time.perf_counter()
            cost = spent + finished - started
            self._next = finished + max(INTERVAL, cost / SHARE)
            self._writing = False

        return write

    @property
    def complete(self) -> bool:
        """Whether the newest checkpoint is of the present frame."""
        return self._captured == self.sim.frame

    def _capture(self, recorded: int | None, state: bool) -> checkpoint.Capture:
        made = checkpoint.capture(self.sim.frames, self.sim.watchdog, self._scenes, state)
        made.header["run"] = {"recorded": recorded, "arguments": self._arguments}
        return made


def _checksum(sim: Reading) -> str:
    """Of the state that a run starts from."""
    digest = 0
    for name in ("position", "velocity"):
        digest = zlib.crc32(sim.state[name].numpy().tobytes(), digest)
    return f"{digest:08x}"


def _plain(arguments: dict[str, Any]) -> dict[str, Any]:
    """As they come back from a file."""
    return json.loads(json.dumps(arguments, default=str))
