"""Paint: the colours of what a USD stage draws, as authored or by a value through a colour map."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from ... import validate
from ...output import colors
from ...output.usd.recording import notes, prims

PLAIN = (0.6, 0.6, 0.6)  # of what has no colour
MOST_SCANNED = 8  # frames
NO_VALUES = {"displayColor", "displayOpacity", "st", "pid"}


@dataclass(frozen=True)
class Paint:
    """How to colour.

    Args:
        color_by: Name of a value that the file holds, or ``"speed"``; of vectors, the length.
            None: colours as they are in the file.
        color_map: A name or colours (k, 3) linear, see :mod:`particlesim.output.colors`.
        color_range: Numbers with the first and the last colour.
    """

    color_by: str | None = None
    color_map: Any = "viridis"
    color_range: tuple[float, float] = (0.0, 1.0)

    def of(self, prim: Usd.Prim, time: Usd.TimeCode, count: int) -> np.ndarray:
        """Linear colours of a prim's ``count`` points, one or as many."""
        found = self.valued(prim, time, count)
        if found is None:
            found, _ = authored(prim, time)
        return found if len(found) == count else found[:1]

    def valued(self, prim: Usd.Prim, time: Usd.TimeCode, count: int) -> np.ndarray | None:
        """Colours by value, (count, 3); None for a prim without the value."""
        if self.color_by is None:
            return None
        values = field(prim, self.color_by, time)
        if values is None or len(values) != count:
            return None
        return colors.colored(values, self.color_map, *self.color_range)


def authored(prim: Usd.Prim, time: Usd.TimeCode) -> tuple[np.ndarray, str]:
    """The display colours of a prim, at least one, (n, 3), and their interpolation."""
    primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance("displayColor")
    found = primvar.ComputeFlattened(time) if primvar else None
    if found is None or not len(found):
        return np.array([PLAIN], dtype=np.float32), "constant"
    return np.asarray(found, dtype=np.float32), str(primvar.GetInterpolation())


def field(prim: Usd.Prim, name: str, time: Usd.TimeCode) -> np.ndarray | None:
    """A value of a prim's points as numbers, (n,); None where it has none."""
    primvar = UsdGeom.PrimvarsAPI(prim).GetPrimvar(name)
    found = primvar.ComputeFlattened(time) if primvar and primvar.HasValue() else None
    if found is None and name == "speed":
        found = prim.GetAttribute("velocities").Get(time) if prim.HasAttribute("velocities") else ()
        found = np.asarray(found if found is not None else ()) / velocity_scale(prim.GetStage())
    if found is None or not len(found):
        return None
    values = np.asarray(found, dtype=np.float64)
    return np.linalg.norm(values, axis=1) if values.ndim == 2 else values


def field_names(stage: Usd.Stage) -> list[str]:
    """Names of the values that points of a stage have."""
    names = {"speed"}
    for prim in prims(stage):
        if prim.IsA(UsdGeom.Boundable):
            for primvar in UsdGeom.PrimvarsAPI(prim).GetPrimvars():
                if primvar.GetInterpolation() in ("vertex", "varying"):
                    names.add(primvar.GetPrimvarName())
    return sorted(names - NO_VALUES)


def check_field(stage: Usd.Stage, name: str) -> None:
    """Refuse a name that the stage has no values of."""
    validate.choice("render", "color", name, field_names(stage))


def spanned(stage: Usd.Stage, name: str, frames: Sequence[float]) -> tuple[float, float]:
    """The range that a colour map should span: nearly all values of some of the frames."""
    found = list(_values(stage, name, scanned(frames)))
    if not found:
        return 0.0, 1.0
    return colors.spanned(np.concatenate(found))


def scanned(frames: Sequence[float]) -> list[float]:
    """Some frames of many, the first and the last among them."""
    at = np.linspace(0, len(frames) - 1, min(len(frames), MOST_SCANNED)).round().astype(int)
    return [frames[k] for k in dict.fromkeys(at.tolist())]


def _values(stage: Usd.Stage, name: str, frames: Iterable[float]) -> Iterable[np.ndarray]:
    for frame in frames:
        for prim in prims(stage):
            if prim.IsA(UsdGeom.Boundable):
                values = field(prim, name, Usd.TimeCode(frame))
                if values is not None:
                    yield values[np.isfinite(values)]


def velocity_scale(stage: Usd.Stage) -> float:
    """Simulated time a second of playback, which authored velocities are scaled by."""
    frame_time = notes(stage).get("frameTime")
    return frame_time * stage.GetTimeCodesPerSecond() if frame_time else 1.0
