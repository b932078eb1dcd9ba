"""USD frames for offline rendering: a root file, and beside it one small file a frame.

``out.usda`` holds what does not change, and tells readers to look for the rest in value clips:
``out.clips/manifest.usda`` and ``out.clips/f.######.usdc``. Every file appears whole, by a
temporary name and ``os.replace``, so that whatever kills the process, finished frames can be read.
Memory does not grow with the number of frames.

What is recorded is described on the host (:mod:`particlesim.usd_info`), so that any source of
arrays can be recorded (:mod:`particlesim.record` does it for simulations). How the root looks
inside is :mod:`particlesim.usd_stage`.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from pxr import Sdf, Tf

from . import usd_stage, validate
from .usd_info import StageInfo

SUFFIXES = (".usda", ".usd", ".usdc")
# Readers take these names to mean something else than a value of the particle.
TAKEN_FIELDS = frozenset(
    "points position velocities velocity accelerations normals widths radius ids pid "
    "displayColor displayOpacity st".split()
)


class UsdWriter:
    """Writes frames, each of them safe as soon as :meth:`write` returns.

    Nothing is created before the first frame. The root is written just before that frame, with the
    planned end, and again by :meth:`close` if the end turned out different.

    Args:
        path: The root file, ``.usda``, ``.usd`` or ``.usdc``; frames go to ``<stem>.clips`` beside.
        info: What to record.
        fields: Further values a particle to :meth:`write`, name to 1 (float) or 3 (float3).
            Their primvars have the same names, made valid.
        overwrite: Replace an existing recording.

    Raises:
        FileExistsError: The output exists, and ``overwrite`` is not set.
        FileNotFoundError: The parent folder does not exist.
        ValueError: Another suffix, a field with a name that is taken or other than 1 or 3 numbers.

    Example:
        >>> from particlesim.usd_info import PointsPrim
        >>> drops = PointsPrim(0, "drops", slice(0, 2), np.arange(2), 0.1, (0.2, 0.5, 0.9))
        >>> with UsdWriter("drops.usda", StageInfo(points=[drops], frames=2, fps=24)) as recorder:
        ...     for frame in range(2):
        ...         recorder.write(frame, np.full((2, 3), frame / 24), np.ones((2, 3)))
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        info: StageInfo,
        *,
        fields: Mapping[str, int] | None = None,
        overwrite: bool = False,
    ):
        self.path = Path(path)
        self.clips = self.path.with_suffix(".clips")
        self.info = info
        self.fields = _field_names(dict(fields or {}))
        self.overwrite = overwrite
        self._refuse_unusable()
        self._layout = usd_stage.layout(info)
        used = [prim.rows for prim in info.points] + [prim.pairs for prim in info.links]
        self._row_count = 1 + max(int(rows.max()) for rows in used)
        self._root: Sdf.Layer | None = None
        self._clip: Sdf.Layer | None = None
        self._frame: int | None = None  # the last one written
        self._planned_end = 0
        self._closed = False

    def write(
        self,
        frame: int,
        position: Any,
        velocity: Any,
        fields: Mapping[str, Any] | None = None,
    ) -> None:
        """Write one frame. When it returns, the frame is in its file, whole.

        Args:
            frame: Its time code. The first may be any (0 is the start state), then one by one.
            position: (n, 3) [length], NumPy or Warp.
            velocity: (n, 3) [length per simulated time].
            fields: (n,) or (n, 3) for every name the recorder was made with.

        Raises:
            ValueError: A frame out of order, arrays of other shapes, fields that are missing, or a
                value that is not finite (in single precision); the message names frame and
                particle. OSError: The file could not be written. Frames before are kept.
        """
        owner = "UsdRecorder.write"
        if self._closed:
            raise validate.fail(
                owner, "frame", "come before close", frame, "make another UsdRecorder"
            )
        frame = validate.whole(owner, "frame", frame)
        if self._frame is not None and frame != self._frame + 1:
            raise validate.fail(
                owner, "frame", f"be {self._frame + 1}, the next", frame, "leave no frame out"
            )
        given = dict(fields or {})
        if given.keys() != self.fields.keys():
            raise validate.fail(
                owner, "fields", f"be {sorted(self.fields)}", sorted(given), "give just these"
            )
        x = self._checked("position", position, 3, frame)
        v = self._checked("velocity", velocity, 3, frame, self.info.velocity_scale)
        values = {
            usd_stage.primvar(name): self._checked(name, given[name], width, frame)
            for name, width in self.fields.items()
        }
        if self._clip is None:
            self._begin(frame, x)
        if frame > self._planned_end:
            # Twice as far, so that long unplanned runs rewrite the root a few times only.
            self._publish_root(2 * frame)
        usd_stage.fill_clip(self._clip, self._layout, self.info, frame, x, v, values)
        _publish(self._clip, self.clips / f"f.{frame:06d}.usdc")
        self._frame = frame

    def close(self) -> None:
        """Give the root the end that was reached. May be called again."""
        if self._root is not None and not self._closed and self._frame != self._planned_end:
            self._publish_root(self._first if self._frame is None else self._frame)
        self._closed = True

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            self.close()
        except OSError:
            if error is None:
                raise
            # The root still stands, with the planned end: the first error is the one to see.

    def _refuse_unusable(self) -> None:
        owner, shown = "UsdRecorder", str(self.path)
        if self.path.suffix not in SUFFIXES:
            raise validate.fail(
                owner, "path", f"end in {', '.join(SUFFIXES)}", shown, "choose one of these"
            )
        if not self.path.parent.is_dir():
            raise FileNotFoundError(
                f"{owner}: path must be in an existing folder, got {shown!r}; "
                f"make {str(self.path.parent)!r} first."
            )
        siblings = [self.path.with_suffix(s) for s in SUFFIXES if s != self.path.suffix]
        for sibling in siblings:
            if sibling.exists() and self.clips.exists():
                raise FileExistsError(
                    f"{owner}: path must not share its frames with another root, got {shown!r} "
                    f"next to {sibling.name!r}; choose another name."
                )
        for existing in (self.path, self.clips):
            if existing.exists() and not self.overwrite:
                raise FileExistsError(
                    f"{owner}: path must be new, got {shown!r} where {existing.name!r} exists; "
                    "choose another, or pass overwrite=True."
                )

    def _begin(self, frame: int, x: np.ndarray) -> None:
        """Everything that has to be on disk before the first frame."""
        self._refuse_unusable()
        self.overwrite = True  # from here on, what exists is this recording's own
        # The old root goes first: it must not lead readers to a mixture of old and new frames.
        self.path.unlink(missing_ok=True)
        self.clips.mkdir(exist_ok=True)
        for stale in [*self.clips.glob("f.*.usdc"), *self.clips.glob("manifest.*usda")]:
            stale.unlink()
        self.info = usd_stage.sized(self.info, x)
        manifest = usd_stage.manifest(self._layout, self.fields, self.info)
        _publish(manifest, self.clips / "manifest.usda")
        self._first = frame
        self._root = usd_stage.author_root(self._layout, self.info, self.fields, x)
        self._publish_root(frame + self.info.frames - 1)
        clip = Sdf.Layer.CreateAnonymous(".usdc")
        clip.TransferContent(manifest)
        self._clip = clip

    def _publish_root(self, end: int) -> None:
        usd_stage.set_frames(self._root, self.clips.name, self._first, end)
        _publish(self._root, self.path)
        self._planned_end = end

    def _checked(
        self, name: str, given: Any, width: int, frame: int, scale: float = 1.0
    ) -> np.ndarray:
        """Single precision, (n, 3) or (n,), finite."""
        owner = "UsdRecorder.write"
        array = np.asarray(given.numpy() if hasattr(given, "numpy") else given)
        row_shape = (3,) if width == 3 else ()
        if array.ndim == 0 or array.shape[1:] != row_shape or len(array) < self._row_count:
            wanted = f"have shape {(self._row_count, *row_shape)}, or more rows"
            raise validate.fail(owner, name, wanted, array.shape, "give a row a particle")
        with np.errstate(over="ignore"):  # becomes infinite, which is found below
            values = np.ascontiguousarray(array, dtype=np.float32) * np.float32(scale)
        if not np.isfinite(values).all():
            row = int(np.argmin(np.isfinite(values.reshape(len(values), -1)).all(axis=1)))
            raise validate.fail(
                owner,
                f"{name} of particle {row}{self._place(row)} at frame {frame}",
                "be finite in single precision",
                array[row],
                "look for what made it so, or take a smaller dt",
            )
        return values

    def _place(self, row: int) -> str:
        for prim, path in zip(self.info.points, self._layout.points, strict=True):
            found = np.flatnonzero(prim.rows == row)
            if len(found):
                return f" ({path}, id {prim.ids[found[0]]})"
        return ""


def _publish(layer: Sdf.Layer, path: Path) -> None:
    """Write a layer so that readers find the old file or the new one, never a part."""
    temporary = path.with_name(f"{path.stem}.tmp{path.suffix}")
    try:
        layer.Export(str(temporary))
        os.replace(temporary, path)
    except (Tf.ErrorException, OSError) as error:
        temporary.unlink(missing_ok=True)
        reason = re.search(r" : '(.*)'", str(error))
        raise OSError(
            f"UsdRecorder: {path} must be writable, got {reason[1] if reason else error}; free "
            "some space or choose another folder. Frames written before are kept."
        ) from error


def _field_names(fields: dict[str, int]) -> dict[str, int]:
    owner = "UsdRecorder"
    primvars: dict[str, str] = {}
    for name, width in fields.items():
        if width not in (1, 3):
            raise validate.fail(
                owner, f"fields[{name!r}]", "have 1 or 3 numbers", width, "split it up"
            )
        primvar = usd_stage.primvar(name)
        if primvar in TAKEN_FIELDS or primvar in primvars:
            taken = f"have another name than {primvars.get(primvar, 'what USD has itself')!r}"
            raise validate.fail(owner, "fields", taken, name, "leave it out or rename it")
        primvars[primvar] = name
    return fields
