"""NumPy archives: one a frame, read with ``numpy.load`` and nothing else."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from .. import files
from .base import KEPT, ParticleFrame
from .folder import FolderRecorder


class NpzRecorder(FolderRecorder):
    """Records frames as NumPy archives, in the precision of the simulation, bit for bit.

    A frame ``out.frames/f.######.npz`` holds ``frame``, ``time`` and the columns of
    :class:`.ParticleFrame`, and with a barostat ``box``, the lengths of the boxes, (worlds, 3).
    ``out.npz`` says what there is: ``first`` and ``last`` frame, ``dt`` between them, the names of
    ``groups`` and ``fields``, and the ``pattern`` of the frames' paths, from the folder of
    ``out.npz``. Until the recording is closed ``last`` is the planned one; frames are whole or not
    there.

    Arguments are those of :class:`~particlesim.output.recorders.base.ParticleRecorder`.

    Example:
        >>> from particlesim import Scene, Simulation
        >>> scene = Scene()
        >>> ball = scene.add_particles([(0, 1, 0)], velocity=(1, 0, 0))
        >>> sim = Simulation(scene, device="cpu")
        >>> with NpzRecorder(sim, "ball.npz") as recorder:
        ...     recorder.write()
        >>> np.load("ball.frames/f.000000.npz")["position"].tolist()
        [[0.0, 1.0, 0.0]]
    """

    suffix = ".npz"
    _told_last = 0  # as the index has it

    def _begin(self, frame: ParticleFrame) -> None:
        super()._begin(frame)
        self._publish_index(self.planned_last)

    def _go_on(self, last: int) -> None:
        super()._go_on(last)
        try:
            with np.load(self.path) as index:
                self._told_last = int(index["last"])
        except (OSError, ValueError, KeyError) as error:
            raise self._refuse_to_go_on(f"{self.path.name} cannot be read ({error})") from error

    def _save(self, path: Path, frame: ParticleFrame) -> None:
        alone: dict[str, Any] = {"frame": np.int64(frame.number), "time": np.float64(frame.time)}
        if self.sim.model.flexible:
            alone["box"] = frame.boxes
        files.write_arrays(path, {**alone, **frame.columns})

    @property
    def rest(self) -> int:
        return self.path.stat().st_size  # once more, with its true end

    def _finish(self) -> None:
        if self.last is not None and self.last != self._told_last:
            self._publish_index(self.last)

    def _publish_index(self, last: int) -> None:
        about = self.identity()
        index = {
            "first": np.int64(self.first),
            "last": np.int64(last),
            "dt": np.float64(about["dt"]),
            "groups": np.array(self.group_names, dtype=np.str_),
            "fields": np.array(self.fields.names, dtype=np.str_),
            "pattern": np.array(f"{self.folder.name}/f.{{:06d}}{self.suffix}"),
        }
        with files.whole(self.owner, self.path, KEPT) as temporary:
            files.write_arrays(temporary, index)
        self._told_last = last
