"""A USD file open for reading: its stage, its value clips, and its frames in small portions."""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Sdf, Tf, Usd, UsdGeom, UsdUtils

from ... import validate
from .layout import Clip, clip_sets, opened

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


@contextlib.contextmanager
def plain_errors() -> Iterator[None]:
    """Turn USD's errors into OSErrors that say why, without where in its own source that was."""
    try:
        yield
    except Tf.ErrorException as error:
        reason = re.search(r" : '(.*)'", str(error))
        raise OSError(reason[1] if reason else " ".join(str(error).split())) from None


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
        self.clip_sets = clip_sets(prims(self.stage))

    def _open(self) -> Usd.Stage:
        try:
            with plain_errors():
                return Usd.Stage.Open(str(self.path))
        except OSError as error:
            raise validate.fail(
                self.owner, "path", "be a USD file that can be read", str(self.path), str(error)
            ) from None

    @property
    def root(self) -> Sdf.Layer:
        """The root layer."""
        return self.stage.GetRootLayer()

    @property
    def clips(self) -> Iterator[Clip]:
        """The clips of all sets."""
        return (clip for each in self.clip_sets for clip in each.clips)

    def frames(self) -> list[float]:
        """Time codes of all frames: those of clips whose file is there, and of time samples."""
        frames = {clip.frame for clip in self.clips if clip.exists}
        with plain_errors():  # of a manifest
            for prim in prims(self.stage):
                for attribute in prim.GetAuthoredAttributes():
                    if attribute.GetResolveInfo().GetSource() == Usd.ResolveInfoSourceTimeSamples:
                        frames.update(attribute.GetTimeSamples())
        return sorted(frames)

    def damaged(self, frame: float) -> Path | None:
        """A file of a frame that is there and cannot be read, as one that was cut off."""
        for clip in self.clips:
            if clip.frame <= frame < clip.until and clip.exists and opened(clip.path) is None:
                return clip.path
        return None

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


def prims(stage: Usd.Stage) -> Any:
    """An iterator of all prims, those of instances too; it can be told to ``PruneChildren``."""
    return iter(Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies()))


def notes(stage: Usd.Stage) -> dict[str, Any]:
    """What a recording says of itself: ``fps``, and ``frameTime`` where that is known."""
    found = stage.GetRootLayer().customLayerData.get("particlesim", {})
    return found if isinstance(found, dict) else {}


def up_axis(stage: Usd.Stage) -> np.ndarray:
    """The direction that is up, (3,)."""
    return np.eye(3)[2 if UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z else 1]


def read(attribute: Usd.Attribute, frame: float | Usd.TimeCode) -> Any:
    """The value at a frame; arrays of numbers as NumPy's, without a copy. None: there is none."""
    try:
        value = attribute.Get(frame)
    except Tf.ErrorException:  # of a file that is damaged
        return None
    if hasattr(value, "__array_interface__") or hasattr(type(value), "FromNumpy"):
        return np.asarray(value)
    return value
