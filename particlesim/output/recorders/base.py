"""What recorders have in common, and what a frame of particles holds."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, Self

import numpy as np

from ... import validate
from ...engine.source import Source
from ..usd.fields import ParticleFields

# What every frame has; a field cannot have these names.
COLUMNS = ("position", "velocity", "radius", "id", "group", "world")


class Recorder(Protocol):
    """Writes frames of a simulation to somewhere, each of them safe when its write returns."""

    def capture(self) -> Any:
        """Copy to the host what the present frame needs, with its ``number``; touch no file.

        None: this frame is not to be recorded.
        """

    def write_frame(self, frame: Any) -> None:
        """Write what :meth:`capture` returned; touch no simulation. Another thread may do it."""

    def write(self) -> None:
        """Capture and write the present frame."""

    def close(self) -> None:
        """Write what has to come at the end. May be called again."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *error: Any) -> None: ...


@dataclass(frozen=True, eq=False)
class ParticleFrame:
    """One frame on the host.

    Args:
        number: From 0, one by one.
        time: Simulated [time].
        columns: ``position`` and ``velocity`` (n, 3), ``radius`` (n,), in the precision of the
            simulation; ``id`` (place in the world's scene), ``group`` (place among the names) and
            ``world``, (n,) int32; and the chosen fields, (n,) or (n, 3).
    """

    number: int
    time: float
    columns: dict[str, np.ndarray]


class ParticleRecorder(ABC):
    """A recorder of particles, without what is around them.

    Args:
        sim: The simulation.
        path: The output; its suffix is the class's.
        frames: How many more frames of the simulation are planned; more or fewer may come.
        fields: Names of further values to write: arrays of the state (``"density"``), attributes
            of the particles, ``"speed"``.
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
        self,
        sim: Source,
        path: str | os.PathLike[str],
        *,
        frames: int = 1,
        fields: Iterable[str] = (),
        every: int = 1,
        overwrite: bool = False,
        resume: int | None = None,
    ):
        self.owner = type(self).__name__
        self.sim, self.path = sim, Path(path)
        self.every = validate.whole(self.owner, "every", every, minimum=1)
        validate.whole(self.owner, "frames", frames)
        self.planned_last = (sim.frame + frames) // self.every
        self.fields = ParticleFields(sim, fields)
        for name in self.fields.names:
            if name in COLUMNS or name == "time":
                raise validate.fail(
                    self.owner, "fields", "have other names than what every frame has", name,
                    "leave it out",
                )  # fmt: skip
        self.group_names, self._constant = _constant_columns(sim)
        self.overwrite, self.resumed = overwrite, resume is not None
        self.last = resume
        self._closed = False
        self._refuse_unusable()
        if resume is not None:
            self._go_on(resume)

    def write(self) -> None:
        """Write the simulation's present state as its present frame, if that is to be recorded."""
        self.write_frame(self.capture())

    def capture(self) -> ParticleFrame | None:
        """Copy to the host all that the present frame needs, and touch no file.

        None: ``every`` leaves this frame out.
        """
        sim = self.sim
        if sim.frame % self.every:
            return None
        radius = sim.get("radius") if "radius" in sim.state else sim.model.column("radius")
        x = sim.get("position")
        columns = {
            "position": x,
            "velocity": sim.get("velocity"),
            "radius": radius.astype(x.dtype),
            **self._constant,
            **self.fields.read(),
        }
        return ParticleFrame(sim.frame // self.every, sim.time, columns)

    def write_frame(self, frame: ParticleFrame | None) -> None:
        """Write what :meth:`capture` returned; touches no simulation.

        Raises:
            ValueError: A frame out of order. OSError: It could not be written; those before are
                kept.
        """
        if frame is None:
            return
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

    def close(self) -> None:
        """Write what has to come at the end. May be called again."""
        if not self._closed and self.last is not None:
            self._finish()
        self._closed = True

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> None:
        try:
            self.close()
        except OSError:
            if error is None:
                raise
            # The first error is the one to see.

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
    def outputs(self) -> list[Path]:
        """Files and folders that the recording is made of."""
        return [self.path]

    @abstractmethod
    def _begin(self, frame: ParticleFrame) -> None:
        """Prepare the output for its first frame, and remove what is overwritten."""

    @abstractmethod
    def _put(self, frame: ParticleFrame) -> None:
        """Write a frame."""

    def _finish(self) -> None:  # noqa: B027  many formats need nothing
        """Write what has to come after the last frame."""

    @abstractmethod
    def _go_on(self, last: int) -> None:
        """Take up an existing output, to replace what comes after frame ``last``."""

    def _refuse_unusable(self) -> None:
        shown = str(self.path)
        if self.path.suffix != self.suffix:
            raise validate.fail(
                self.owner, "path", f"end in {self.suffix}", shown, "choose another recorder"
            )
        if not self.path.parent.is_dir():
            raise FileNotFoundError(
                f"{self.owner}: path must be in an existing folder, got {shown!r}; "
                f"make {str(self.path.parent)!r} first."
            )
        for existing in self.outputs:
            if existing.exists() and not (self.overwrite or self.resumed):
                raise FileExistsError(
                    f"{self.owner}: path must be new, got {shown!r} where {existing.name!r} "
                    "exists; choose another, or pass overwrite=True."
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
