"""What is inside a USD file."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pxr import Usd, UsdGeom

from ...engine.report import Report
from .recording import Recording, notes, prims, quiet, read

COUNTED = {  # which array says how many there are, and what they are called
    "Points": ("points", "points"),
    "PointInstancer": ("positions", "instances"),
    "Mesh": ("faceVertexCounts", "faces"),
    "BasisCurves": ("curveVertexCounts", "curves"),
}


@dataclass(frozen=True)
class PrimInfo:
    """One prim that is drawn, or several alike in different worlds.

    ``path`` has ``####`` for the number of the world; ``count`` is the least and the largest
    number over the frames and prims; ``size`` the bytes of values in a frame, the largest, summed
    over the prims.
    """

    path: str
    type: str
    prims: int
    count: tuple[int, int]
    unit: str
    primvars: tuple[str, ...]
    moving: bool
    size: int


@dataclass(frozen=True, repr=False)
class Info(Report):
    """What :func:`info` found; ``str`` shows it as a table."""

    path: Path
    prims: tuple[PrimInfo, ...]
    frames: tuple[float, ...]
    missing: int
    start: float
    end: float
    fps: float
    frame_time: float | None
    up_axis: str
    meters_per_unit: float
    default_prim: str
    files: int
    size: int

    def __str__(self) -> str:
        return "\n".join([*self._heading(), "", *_table(self.prims)])

    def _heading(self) -> list[str]:
        files = "1 file" if self.files == 1 else f"{self.files} files"
        span = f"{len(self.frames)} frames"
        if self.frames:
            span += f", {self.frames[0]:g} to {self.frames[-1]:g}"
        if self.missing:
            span += f" ({self.missing} planned ones are not there)"
        seconds = (self.end - self.start) / self.fps if self.fps > 0 else 0.0
        time = f"{self.fps:g} a second, {seconds:g} s of playback"
        if self.frame_time:
            time += f", {self.frame_time * (self.end - self.start):g} s simulated"
        return [
            f"{self.path}: {_bytes(self.size)} in {files}",
            f"frames     {span}; {time}",
            f"stage      {self.default_prim or 'no default prim'}, {self.up_axis} up, "
            f"{self.meters_per_unit:g} m a unit",
        ]


def info(path: str | os.PathLike[str]) -> Info:
    """Look into a USD file.

    Args:
        path: The file: a recording, or any other.

    Raises:
        FileNotFoundError: There is no such file. ValueError: It cannot be read as USD.

    Example:
        >>> from particlesim import Scene, Simulation
        >>> scene = Scene()
        >>> ball = scene.add_particles([(0, 1, 0)], velocity=(1, 0, 0), radius=0.1)
        >>> Simulation(scene, device="cpu").run(2, record="ball.usda")
        >>> found = info("ball.usda")
        >>> len(found.frames), [prim.count for prim in found.prims if prim.type == "Points"]
        (3, [(1, 1)])
    """
    with quiet():
        recording = Recording("usd.info", path)
        frames, stage = recording.frames(), recording.stage
        files = _files(recording)
        planned = {clip.frame for clip in recording.clips}
        return Info(
            path=recording.path,
            prims=tuple(_prims(recording, frames)),
            frames=tuple(frames),
            missing=len(planned - set(frames)),
            start=stage.GetStartTimeCode(),
            end=stage.GetEndTimeCode(),
            fps=stage.GetTimeCodesPerSecond(),
            frame_time=notes(stage).get("frameTime"),
            up_axis=str(UsdGeom.GetStageUpAxis(stage)),
            meters_per_unit=UsdGeom.GetStageMetersPerUnit(stage),
            default_prim=str(stage.GetDefaultPrim().GetPath()) if stage.GetDefaultPrim() else "",
            files=len(files),
            size=sum(file.stat().st_size for file in files),
        )


def _files(recording: Recording) -> set[Path]:
    """The files that it consists of and that are there."""
    found = {Path(layer.realPath) for layer in recording.stage.GetUsedLayers() if layer.realPath}
    found |= {clip.path for clip in recording.clips}
    found |= {each.manifest for each in recording.clip_sets if each.manifest}
    return {file.resolve() for file in found if file.is_file()}


def _prims(recording: Recording, frames: Sequence[float]) -> list[PrimInfo]:
    """Everything that is drawn, worlds put together."""
    counts: dict[str, list[int]] = {}
    sizes: dict[str, int] = {}
    first: dict[str, tuple[str, str, tuple[str, ...], bool]] = {}

    def look(stage: Usd.Stage, some: list[float]) -> list[None]:
        for prim in prims(stage):
            drawn = prim.IsA(UsdGeom.Gprim) or prim.IsA(UsdGeom.PointInstancer)
            if not drawn:
                continue
            path, kind = str(prim.GetPath()), str(prim.GetTypeName())
            array, unit = COUNTED.get(kind, ("", ""))
            attributes = [each for each in prim.GetAuthoredAttributes() if each.HasValue()]
            moving = any(each.ValueMightBeTimeVarying() for each in attributes)
            if path not in first:
                first[path] = (kind, unit, _primvars(prim), moving)
                counts[path], sizes[path] = [], 0
            elif not moving:
                continue
            for frame in some if moving else some[:1]:
                values = {each.GetName(): read(each, frame) for each in attributes}
                held = [v for v in values.values() if isinstance(v, np.ndarray)]
                sizes[path] = max(sizes[path], sum(v.nbytes for v in held))
                if values.get(array) is not None:
                    counts[path].append(len(values[array]))
        return []

    recording.visit(frames or [0.0], look)
    return _grouped(first, counts, sizes)


def _grouped(
    first: dict[str, tuple[str, str, tuple[str, ...], bool]],
    counts: dict[str, list[int]],
    sizes: dict[str, int],
) -> list[PrimInfo]:
    """Prims that are alike but for their world become one."""
    groups: dict[tuple, list[str]] = {}
    for path, kind in first.items():
        pattern = re.sub(r"/env_\d+", "/env_####", path)
        groups.setdefault((pattern, *kind), []).append(path)
    result = []
    for (pattern, kind, unit, primvars, moving), paths in groups.items():
        every = [count for path in paths for count in counts[path]] or [1]
        result.append(
            PrimInfo(
                pattern if len(paths) > 1 else paths[0], kind, len(paths),
                (min(every), max(every)), unit, primvars, moving,
                sum(sizes[path] for path in paths),
            )
        )  # fmt: skip
    return result


def _primvars(prim: Usd.Prim) -> tuple[str, ...]:
    found = UsdGeom.PrimvarsAPI(prim).GetPrimvars()
    return tuple(each.GetPrimvarName() for each in found if each.GetAttr().IsAuthored())


def _table(rows: Sequence[PrimInfo]) -> list[str]:
    """One line a row, in columns."""
    lines = [("prim", "type", "", "moves", "a frame", "primvars")]
    for row in rows:
        low, high = row.count
        count = (f"{low}" if low == high else f"{low}..{high}") + f" {row.unit}" if row.unit else ""
        times = f"{row.prims} x " if row.prims > 1 else ""
        lines.append(
            (row.path, row.type, times + count, "yes" if row.moving else "no", _bytes(row.size),
             ", ".join(row.primvars))
        )  # fmt: skip
    widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
    return [
        "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()
        for line in lines
    ]


def _bytes(size: float) -> str:
    """A number of bytes with a prefix."""
    for prefix in ("", "Ki", "Mi"):
        if size < 1000:
            return f"{size:.3g} {prefix}B"
        size /= 1024
    return f"{size:.3g} GiB"
