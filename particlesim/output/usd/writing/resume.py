"""Taking up a USD recording where another process had to leave it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Sdf, Tf

from .... import validate
from ..description import StageInfo
from ..layout import MANIFEST, Layout, clip_file
from .root import sized
from .samples import Fields, manifest


@dataclass(frozen=True, eq=False)
class TakenUp:
    """A recording on disk, as its writer would have it in memory."""

    root: Sdf.Layer
    manifest: Sdf.Layer
    info: StageInfo
    first: int
    end: int
    notes: dict[str, Any]  # of the last frame that is kept


def take_up(
    root: Path, clips: Path, paths: Layout, info: StageInfo, fields: Fields, last: int
) -> TakenUp:
    """Read what is needed to go on after frame ``last``.

    Args:
        root: The root file.
        clips: The folder of its frames.
        paths: Where the prims of the description are.
        info: The description of what is to go on.
        fields: Name to kind, as for the writer.
        last: The last frame to keep.

    Raises:
        ValueError: The recording is of something else, or frames up to ``last`` are missing.
    """
    try:
        layer = Sdf.Layer.OpenAsAnonymous(str(root))
        first, end = int(layer.startTimeCode), int(layer.endTimeCode)
        files = [clip_file(clips, number) for number in range(first, last + 1)]
        missing = [each.name for each in files if not each.is_file() or not each.stat().st_size]
        if missing or not files:
            raise _refused(root, f"{missing[0] if missing else 'every frame'} is missing")
        found = Sdf.Layer.OpenAsAnonymous(str(clips / MANIFEST))
        clip = Sdf.Layer.OpenAsAnonymous(str(files[0]))
        newest = Sdf.Layer.OpenAsAnonymous(str(files[-1]))
    except (Tf.ErrorException, OSError) as error:
        raise _refused(root, "a file of it cannot be read") from error
    info = sized(info, list(_points(clip, paths, first)))
    expected = manifest(paths, fields, info)
    if found.ExportToString() != expected.ExportToString():
        raise _refused(root, "it was recorded with other groups, fields or settings")
    notes = dict(newest.customLayerData.get("particlesim", {}))
    return TakenUp(layer, expected, info, first, end, notes)


def _points(clip: Sdf.Layer, paths: Layout, frame: int) -> Iterator[np.ndarray]:
    """Positions of every group in a frame, (n, 3) each."""
    for path in paths.points:
        for name in ("points", "positions"):
            value = clip.QueryTimeSample(path.AppendProperty(name), frame)
            if value is not None:
                yield np.asarray(value)


def _refused(root: Path, why: str) -> ValueError:
    return validate.fail(
        "UsdRecorder", "path", "be a recording of this simulation", str(root),
        f"{why}, so record it anew with overwrite=True",
    )  # fmt: skip
