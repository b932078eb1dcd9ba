"""A USD file open for reading: its stage, its value clips, and its frames in small portions."""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Sdf, Tf, Usd, UsdUtils

from ... import validate

PORTION = 16  # frames that are read before the clip files of a stage are let go
CLIPS = Usd.ResolveInfoSourceValueClips


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Keep USD's warnings from the terminal: what matters is said in the tools' own words."""
    delegate = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        yield
    finally:
        delegate.TakeUncoalescedDiagnostics()
        del delegate


@dataclass(frozen=True)
class Clip:
    """One file of a clip set: what it holds is seen from stage time ``frame`` to ``until``.

    ``time`` is the time code inside the file.
    """

    frame: float
    until: float
    time: float
    path: Path


@dataclass(frozen=True)
class ClipSet:
    """The value clips of one prim; ``inside`` is the path that its prim has in the clip files."""

    prim: Sdf.Path
    inside: Sdf.Path
    manifest: Path | None
    clips: tuple[Clip, ...]

    def outside(self, path: Sdf.Path) -> Sdf.Path:
        """Path on the stage of what has ``path`` in a clip."""
        return path.ReplacePrefix(self.inside, self.prim)


class Recording:
    """A USD file for reading.

    Args:
        owner: Who asks, for errors.
        path: The root file.

    Raises:
        FileNotFoundError: There is no such file. ValueError: It cannot be read as USD.
    """

    def __init__(self, owner: str, path: str | os.PathLike[str]):
        self.owner, self.path = owner, Path(path)
        if not self.path.exists():
            raise FileNotFoundError(
                f"{owner}: path must be a USD file, got {str(path)!r}, which does not exist; "
                "look for its name."
            )
        self.stage = self._open()
        self.clip_sets = _clip_sets(self.stage)

    def _open(self) -> Usd.Stage:
        try:
            return Usd.Stage.Open(str(self.path))
        except Tf.ErrorException as error:
            reason = re.search(r" : '(.*)'", str(error))
            raise validate.fail(
                self.owner, "path", "be a USD file that can be read", str(self.path),
                reason[1] if reason else "record it again",
            ) from None  # fmt: skip

    @property
    def root(self) -> Sdf.Layer:
        """The root layer."""
        return self.stage.GetRootLayer()

    def frames(self) -> list[float]:
        """Time codes of all frames: those of clips whose file is there, and of time samples."""
        frames = {
            clip.frame for each in self.clip_sets for clip in each.clips if clip.path.is_file()
        }
        for prim in prims(self.stage):
            for attribute in prim.GetAuthoredAttributes():
                if attribute.GetResolveInfo().GetSource() == Usd.ResolveInfoSourceTimeSamples:
                    frames.update(attribute.GetTimeSamples())
        return sorted(frames)

    def visit(
        self, frames: Sequence[float], work: Callable[[Usd.Stage, list[float]], list[Any]]
    ) -> list[Any]:
        """What ``work`` returns for a few frames at a time, each on a stage of its own, joined.

        A stage keeps every clip file that it has read open, and what is left of it (an attribute
        is enough) keeps them even longer: nothing of it may outlive ``work``.
        """
        results: list[Any] = []
        for start in range(0, len(frames), PORTION):
            results += work(self._open(), list(frames[start : start + PORTION]))
        return results


def prims(stage: Usd.Stage) -> Iterator[Usd.Prim]:
    """All prims that are drawn or hold something that is, those of instances too."""
    return iter(Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies()))


def _clip_sets(stage: Usd.Stage) -> list[ClipSet]:
    found = []
    for prim in prims(stage):
        if not prim.HasAuthoredMetadata("clips"):
            continue
        specs = [spec for spec in prim.GetPrimStack() if spec.HasInfo("clips")]
        for described in Usd.ClipsAPI(prim).GetClips().values():
            if not isinstance(described, dict):
                continue
            layer = specs[0].layer
            manifest = described.get("manifestAssetPath")
            found.append(
                ClipSet(
                    prim.GetPath(),
                    Sdf.Path(described.get("primPath", str(prim.GetPath()))),
                    _anchored(layer, manifest.path) if manifest and manifest.path else None,
                    tuple(_templated(layer, described) or _listed(layer, described)),
                )
            )
    return found


def _anchored(layer: Sdf.Layer, path: str) -> Path:
    return Path(layer.ComputeAbsolutePath(path))


def _templated(layer: Sdf.Layer, described: dict) -> list[Clip]:
    """Clips named by number: one a stride, from start to end."""
    pattern = described.get("templateAssetPath", "")
    start, end, stride = (
        float(described.get(f"template{name}", 0.0)) for name in ("StartTime", "EndTime", "Stride")
    )
    digits = re.search(r"(#+)(?:\.(#+))?(?!.*#)", pattern)
    if digits is None or stride <= 0:
        return []
    clips = []
    for frame in start + stride * np.arange(int((end - start) / stride + 1e-6) + 1):
        number = f"{int(frame):0{len(digits[1])}d}"
        if digits[2]:
            number = f"{frame:0{len(digits[1]) + 1 + len(digits[2])}.{len(digits[2])}f}"
        name = pattern[: digits.start()] + number + pattern[digits.end() :]
        clips.append(Clip(frame, frame + stride, frame, _anchored(layer, name)))
    return clips


def _listed(layer: Sdf.Layer, described: dict) -> list[Clip]:
    """Clips that are named one by one."""
    paths = [_anchored(layer, asset.path) for asset in described.get("assetPaths", ())]
    active = sorted((float(t), int(k)) for t, k in described.get("active", ()))
    times = np.array(described.get("times", ()), dtype=float).reshape(-1, 2)
    starts = [t for t, _ in active] + [float("inf")]
    return [
        Clip(
            frame,
            until,
            float(np.interp(frame, times[:, 0], times[:, 1])) if len(times) else frame,
            paths[k],
        )
        for (frame, k), until in zip(active, starts[1:], strict=True)
        if 0 <= k < len(paths)
    ]
