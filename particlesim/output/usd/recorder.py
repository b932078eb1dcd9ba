"""Recording a simulation into USD, frame by frame."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...engine.source import Source
from ..fields import ParticleColors
from ..recorders.base import Recorder
from .drawing import Drawing
from .layout import MANIFEST, clip_file
from .writing.writer import UsdWriter


@dataclass(frozen=True, eq=False)
class FrameData:
    """All that is written of one frame, on the host (see :meth:`Recorder.capture`).

    ``changing`` are the further arguments of :meth:`.UsdWriter.write`.
    """

    number: int
    position: np.ndarray
    velocity: np.ndarray
    fields: dict[str, np.ndarray]
    changing: dict[str, Any] = field(default_factory=dict)


class UsdRecorder(Recorder):
    """Records the frames of a simulation into a USD file, each safe as soon as it is written.

    Groups are drawn as points; those that were given triangles as meshes with normals, less the
    triangles of which an edge is broken. Pairs of constraints and springs are drawn as curves,
    unless both ends are in one mesh, and until they break. Boundaries are meshes, and have a
    transform in every frame where they move.

    Args:
        sim: The simulation.
        path: The root file, ``.usda``, ``.usd`` or ``.usdc``; frames go to ``<stem>.clips``.
        frames: How many more frames of the simulation are planned; more or fewer may come.
        fields: Names of further values to write as primvars: arrays of the state (``"density"``,
            ``"force"``), attributes of the particles, ``"speed"``; in the simulation's units.
        fps: Frames a second of playback; None: in real time where that is sensible, else 24.
        overwrite: Replace an existing recording.
        worlds: Which worlds to record, by number; None: all.
        groups: Which groups, by name or themselves; None: all.
        layout: None leaves the worlds where they are; ``"grid"`` puts them side by side on the
            ground; (3,) is the way from each to the next [length]. It becomes the transform of
            ``/World/env_####``: points keep their positions.
        every: Record every k-th frame of the simulation, those whose number k divides. Time codes
            still count one by one: code c is the simulation's frame k c, and playback keeps its
            speed with 1/k of the frames a second.
        color_by: Colour particles by a value, any name that ``fields`` takes; vectors by their
            length. None: each group has its own colour, as surfaces of fluids always have.
        color_map: ``"viridis"``, ``"magma"``, ``"cubehelix"``, ``"coolwarm"``, ``"gray"``, or
            colours (k, 3), linear.
        color_range: (lower, upper) numbers with the first and the last colour; None: those
            that nearly all values of the frames so far are between, so the range may grow; each
            frame's file notes its own.
        instancer: Draw groups as a PointInstancer of spheres. Files are larger, and Blender shows
            no colours of instances.
        surface: Draw the fluid of each SPH as one mesh a frame, its surface, and leave its
            particles out; options of :class:`~particlesim.Surface`, or True for none.
        resume: Go on after the recorded frame of this number; those after it are replaced.

    Raises:
        FileExistsError, FileNotFoundError, ValueError: As :class:`.UsdWriter`, and names of
            worlds, groups, fields and colour maps that are not there.

    Example:
        >>> from particlesim import Scene, Simulation
        >>> scene = Scene()
        >>> ball = scene.add_particles([(0, 1, 0)], velocity=(1, 0, 0), radius=0.1)
        >>> sim = Simulation(scene, device="cpu")
        >>> with UsdRecorder(sim, "ball.usda", frames=1, color_by="speed") as recorder:
        ...     recorder.write()
        ...     sim.step()
        ...     recorder.write()
    """

    def __init__(
        self, sim: Source, path: str | os.PathLike[str], *, frames: int = 1,
        fields: Iterable[str] = (), fps: float | None = None, overwrite: bool = False,
        worlds: Iterable[int] | None = None, groups: Iterable[Any] | None = None,
        layout: Any = None, every: int = 1, color_by: str | None = None,
        color_map: Any = "viridis", color_range: tuple[float, float] | None = None,
        instancer: bool = False, surface: bool | Mapping[str, Any] = False,
        resume: int | None = None,
    ):  # fmt: skip
        super().__init__(sim, path, frames, fields, every)
        first, last = -(-sim.frame // self.every), (sim.frame + frames) // self.every
        self.drawing = Drawing(
            sim, frames=max(1, last - first + 1), frame_time=self.every * sim.settings.dt, fps=fps,
            worlds=worlds, groups=groups, layout=layout, instancer=instancer,
            surface=surface,
        )  # fmt: skip
        kinds = {name: self.fields.kind(name) for name in self.fields.names}
        self.colors: ParticleColors | None = None
        if color_by is not None:
            rows = self.drawing.rows
            self.colors = ParticleColors(sim, color_by, color_map, color_range, rows)
            kinds["displayColor"] = "color"
        self.writer = UsdWriter(
            self.path, self.drawing.info, fields=kinds, overwrite=overwrite, resume=resume
        )
        if self.colors is not None:
            self.colors.restore(self.writer.notes)

    def _capture(self) -> FrameData:
        fields = self.fields.read()
        changing: dict[str, Any] = {
            "pairs": self.drawing.pairs(),
            "meshes": self.drawing.meshes(),
            "poses": self.drawing.poses(),
            "box": self.drawing.box(),
        }
        if self.colors is not None:
            fields["displayColor"] = self.colors.read()
            changing["notes"] = self.colors.notes()
        sim = self.sim
        number = sim.frame // self.every
        return FrameData(number, sim.get("position"), sim.get("velocity"), fields, changing)

    def _write(self, frame: FrameData) -> None:
        self.writer.write(
            frame.number, frame.position, frame.velocity, frame.fields, **frame.changing
        )

    def files_of(self, number: int) -> list[Path]:
        clips = self.writer.clips
        return [clip_file(clips, number), clips / MANIFEST, self.path]

    @property
    def rest(self) -> int:
        return self.path.stat().st_size  # once more, with its true end

    def _close(self) -> None:
        self.writer.close()
