"""What recorders have in common, and what a frame of particles holds."""

from __future__ import annotations

import os
from abc import abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ... import validate
from ...engine.source import Source
from ...engine.state import OF_WORLDS
from .. import files
from ..fields import ParticleFields
from ..lock import Lock
from ..skin import Skin, read_broken

# What every frame has; a field cannot have these names.
COLUMNS = ("position", "velocity", "radius", "id", "group", "world")
KEPT = "Frames written before are kept."


class Recorder(files.Closing):
    """Writes frames of a simulation to somewhere, each of them safe when its write returns.

    Args:
        sim: The simulation.
        path: The output.
        frames: How many more frames of the simulation are planned; more or fewer may come.
        fields: Names of further values to write.
        every: Record every k-th frame of the simulation; recorded frames count one by one.
    """

    needs: tuple[str, str] | None = None  # a module, and the extra that installs it

    def __init__(
        self, sim: Source, path: str | os.PathLike[str], frames: int, fields: Iterable[str],
        every: int,
    ):  # fmt: skip
        self.owner = type(self).__name__
        self.sim, self.path = sim, Path(path)
        self.every = validate.whole(self.owner, "every", every, minimum=1)
        self.planned_last = (sim.frame + validate.whole(self.owner, "frames", frames)) // every
        self.fields = ParticleFields(sim, fields, self.owner)
        self._unsynced: dict[Path, None] = {}  # in order
        self.locked = False  # by whoever writes through this recorder, or by itself
        self._lock: Lock | None = None

    @classmethod
    def library(cls) -> Any:
        """The module that the format needs, None for none.

        Raises:
            ImportError: It is not installed; the message names the extra.
        """
        return None if cls.needs is None else validate.installed(cls.__name__, *cls.needs)

    def write(self) -> None:
        """Write the simulation's present state as its present frame, if that is to be recorded."""
        self.write_frame(self.capture())

    def capture(self) -> Any:
        """Copy to the host all that the present frame needs, with its ``number``; touch no file.

        What it returns shares nothing with the simulation: another thread may write it while the
        simulation goes on. None: ``every`` leaves this frame out.
        """
        return None if self.sim.frame % self.every else self._capture()

    def write_frame(self, frame: Any) -> None:
        """Write what :meth:`capture` returned; touches no simulation.

        Raises:
            ValueError: A frame out of order. OSError: It could not be written, or somebody else is
                writing there; those before are kept.
        """
        if frame is None:
            return
        if not self.locked:
            self._lock = Lock(self.owner, self.path)
            self.locked = True
        self._write(frame)
        self._unsynced.update(dict.fromkeys(self.files_of(frame.number)))

    def sync(self) -> None:
        """Return only when the disk has all frames, so that they outlive a loss of power.

        Raises:
            OSError: It cannot take them.
        """
        try:
            files.sync(self._unsynced)
        except OSError as error:
            raise files.unwritable(self.owner, self.path, error, KEPT) from error
        self._unsynced.clear()

    @abstractmethod
    def files_of(self, number: int) -> list[Path]:
        """The files that hold a frame, and those that lead to it."""

    @property
    def rest(self) -> int:
        """How much room :meth:`close` needs on the disk, as far as can be told [bytes]."""
        return 0

    def close(self) -> None:
        """Write what has to come at the end. May be called again."""
        try:
            self._close()
        finally:
            if self._lock is not None:
                self._lock.close()
                self._lock, self.locked = None, False

    @abstractmethod
    def _capture(self) -> Any:
        """A frame that is to be recorded."""

    @abstractmethod
    def _write(self, frame: Any) -> None:
        """Write it."""

    @abstractmethod
    def _close(self) -> None:
        """Write the end, once."""


@dataclass(frozen=True, eq=False)
class ParticleFrame:
    """One frame on the host.

    Args:
        number: From 0, one by one.
        time: Simulated [time].
        columns: ``position`` and ``velocity`` (n, 3), ``radius`` (n,), in the precision of the
            simulation; ``id`` (place in the world's scene), ``group`` (place among the names) and
            ``world``, (n,) int32; and the chosen fields, (n,) or (n, 3).
        boxes: Lengths of the worlds' periodic boxes, (worlds, 3); 0 on open axes.
        triangles: (t, 3) rows, of the groups that are drawn as such, less those that are torn.
    """

    number: int
    time: float
    columns: dict[str, np.ndarray]
    boxes: np.ndarray
    triangles: np.ndarray


class ParticleRecorder(Recorder):
    """A recorder of particles, without what is around them.

    Args:
        sim: The simulation.
        path: The output; its suffix is the class's.
        frames: How many more frames of the simulation are planned; more or fewer may come.
        fields: Names of further values to write: arrays of the state (``"density"``, in a periodic
            scene ``"image"``), attributes of the particles, ``"speed"``, ``"unwrapped"`` positions.
        every: Record every k-th frame of the simulation; recorded frames count one by one.
        overwrite: Replace an existing output.
        resume: Go on after the recorded frame of this number; those after it are replaced.

    Raises:
        FileExistsError: The output exists, and ``overwrite`` is not set.
        FileNotFoundError: The parent folder does not exist.
        ImportError: The format needs a package that is not installed; the message names the extra.
        ValueError: Another suffix, a field that is not there, an output that is not of this
            simulation when it is to be resumed.
    """

    suffix = ""

    def __init__(
        self, sim: Source, path: str | os.PathLike[str], *, frames: int = 1,
        fields: Iterable[str] = (), every: int = 1, overwrite: bool = False,
        resume: int | None = None,
    ):  # fmt: skip
        super().__init__(sim, path, frames, fields, every)
        for name in self.fields.names:
            if name in COLUMNS or name in OF_WORLDS:
                raise validate.fail(
                    self.owner, "fields", "have other names than what every frame has", name,
                    "leave it out",
                )  # fmt: skip
        self.group_names, self._constant = _constant_columns(sim)
        self.skins = [
            (int(sim.model.offsets[w]) + group.start, Skin(group, sim.constraints, w))
            for w, scene in enumerate(sim.scenes)
            for group in scene.groups
            if group.triangles is not None
        ]  # with their first rows
        self.overwrite, self.resumed = overwrite, resume is not None
        self.last = resume
        self._closed = False
        self._refuse_unusable()
        if resume is not None:
            self._go_on(resume)

    def _capture(self) -> ParticleFrame:
        sim = self.sim
        radius = sim.get("radius") if "radius" in sim.state else sim.model.column("radius")
        x = sim.get("position")
        columns = {
            "position": x,
            "velocity": sim.get("velocity"),
            "radius": radius.astype(x.dtype),
            **self._constant,
            **self.fields.read(),
        }
        boxes = sim.model.box_length.copy()
        return ParticleFrame(sim.frame // self.every, sim.time, columns, boxes, self._triangles())

    def _triangles(self) -> np.ndarray:
        broken = read_broken(part for _, skin in self.skins for part, _ in skin.sides)
        every = [first + skin.whole(broken) for first, skin in self.skins]
        return np.concatenate([np.zeros((0, 3), dtype=np.int64), *every])

    def _write(self, frame: ParticleFrame) -> None:
        if self._closed or (self.last is not None and frame.number != self.last + 1):
            wanted = "come before close" if self._closed else "be the next"
            raise validate.fail(
                f"{self.owner}.write", "frame", wanted, frame.number, "leave no frame out"
            )
        if self.last is None:
            self._refuse_unusable()
            self.overwrite = True  # from here on, what exists is this recording's own
            self._begin(frame)
        self._put(frame)
        self.last = frame.number

    def _close(self) -> None:
        if not self._closed and self.last is not None:
            self._finish()
        self._closed = True

    def identity(self) -> dict[str, Any]:
        """What must agree for a recording to be gone on with, as JSON."""
        sim = self.sim
        return {
            "dt": sim.settings.dt * self.every,
            "precision": sim.settings.precision,
            "fields": self.fields.names,
            "groups": self.group_names,
            "worlds": sim.model.world_count,
            "particles": sim.model.particle_count,
        }

    @property
    def beside(self) -> list[Path]:
        """Further files and folders that the recording is made of."""
        return []

    @abstractmethod
    def _begin(self, frame: ParticleFrame) -> None:
        """Prepare the output for its first frame, and remove what is overwritten."""

    @abstractmethod
    def _put(self, frame: ParticleFrame) -> None:
        """Write a frame."""

    def _finish(self) -> None:
        """Write what has to come after the last frame."""

    @abstractmethod
    def _go_on(self, last: int) -> None:
        """Take up an existing output, to replace what comes after frame ``last``."""

    def _refuse_unusable(self) -> None:
        may_exist = self.overwrite or self.resumed
        files.check_new(
            self.owner, self.path, may_exist, suffixes=[self.suffix], beside=self.beside
        )

    def _refuse_to_go_on(self, why: str) -> ValueError:
        return validate.fail(
            self.owner, "path", "be a recording of this simulation", str(self.path),
            f"{why}, so record it anew with overwrite=True",
        )  # fmt: skip


def _constant_columns(sim: Source) -> tuple[list[str], dict[str, np.ndarray]]:
    """Names of the groups, and the columns that never change: id, group and world."""
    names = list(dict.fromkeys(group.name for scene in sim.scenes for group in scene.groups))
    ids = np.zeros(sim.model.particle_count, dtype=np.int32)
    groups = np.zeros(sim.model.particle_count, dtype=np.int32)
    for w, scene in enumerate(sim.scenes):
        offset = int(sim.model.offsets[w])
        for group in scene.groups:
            rows = slice(offset + group.start, offset + group.stop)
            ids[rows], groups[rows] = group.indices, names.index(group.name)
    world = np.asarray(sim.model.world_of, dtype=np.int32)
    return names, {"id": ids, "group": groups, "world": world}
