"""USD frames for offline rendering: a root file, and beside it one small file a frame.

``out.usda`` holds what does not change, and tells readers to look for the rest in value clips:
``out.clips/manifest.usda`` and ``out.clips/f.######.usdc``. Every file appears whole, by a
temporary name and ``os.replace``, so that whatever kills the process, finished frames can be read.
Memory does not grow with the number of frames.

What is recorded is described on the host (:mod:`particlesim.output.usd.info`), so that any source of
arrays can be recorded (:mod:`particlesim.output.usd.recorder` does it for simulations). How the root looks
inside is :mod:`particlesim.output.usd.stage`, what clips hold :mod:`particlesim.output.usd.clips`.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from pxr import Sdf, Tf

from ... import validate
from .. import files
from . import clips, stage
from .frame import Frame, FrameChecker, field_kinds
from .info import LinksPrim, MeshPrim, PointsPrim, Shape, StageInfo
from .resume import take_up

SUFFIXES = (".usda", ".usd", ".usdc")


class UsdWriter:
    """Writes frames, each of them safe as soon as :meth:`write` returns.

    Nothing is created before the first frame. The root is written just before that frame, with the
    planned end, and again by :meth:`close` if the end turned out different.

    Args:
        path: The root file, ``.usda``, ``.usd`` or ``.usdc``; frames go to ``<stem>.clips`` beside.
        info: What to record.
        fields: Further values a particle to :meth:`write`, name to kind: 1 (float), 3 (float3),
            ``"int"`` or ``"color"`` (color3f). Their primvars have the same names, made valid.
            ``displayColor`` (a colour, linear) and ``widths`` (1, diameters) take the place of
            what the description has for a whole group.
        overwrite: Replace an existing recording.
        resume: Go on after this frame of an existing recording: the first of :meth:`write` is the
            next. Later frames that are there are replaced, one by one.

    Raises:
        FileExistsError: The output exists, and ``overwrite`` is not set.
        FileNotFoundError: The parent folder does not exist.
        ValueError: Another suffix, a field with a name that is taken or of another kind, a
            recording to be resumed that is of something else.

    Example:
        >>> from particlesim.output.usd import PointsPrim
        >>> drops = PointsPrim(0, "drops", slice(0, 2), np.arange(2), 0.1, (0.2, 0.5, 0.9))
        >>> with UsdWriter("drops.usda", StageInfo(points=[drops], frames=2, fps=24)) as writer:
        ...     for frame in range(2):
        ...         writer.write(frame, np.full((2, 3), frame / 24), np.ones((2, 3)))

        Rows, pairs and triangles that a description leaves open come with every frame:

        >>> spray = PointsPrim(0, "spray", None, None, 0.1, (0.2, 0.5, 0.9))
        >>> with UsdWriter("spray.usda", StageInfo(points=[spray], frames=2, fps=24)) as writer:
        ...     for frame in range(2):
        ...         alive = np.arange(frame, 2)
        ...         x = np.full((2, 3), frame / 24)
        ...         writer.write(frame, x, np.ones((2, 3)), rows={spray: (alive, alive)})
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        info: StageInfo,
        *,
        fields: Mapping[str, int | str] | None = None,
        overwrite: bool = False,
        resume: int | None = None,
    ):
        self.path = Path(path)
        self.clips = self.path.with_suffix(".clips")
        self.info = info
        self.fields = field_kinds(fields or {})
        self.overwrite = overwrite or resume is not None
        self._refuse_unusable()
        self._layout = clips.layout(info)
        self._checker = FrameChecker(info, self._layout.points, self.fields)
        self._root: Sdf.Layer | None = None
        self._clip: Sdf.Layer | None = None
        self._frame = resume  # the last one written
        self._planned_end = 0
        self._closed = False
        self.notes: dict[str, Any] = {}  # of the frame to go on from
        if resume is not None:
            self._go_on(resume)

    def write(
        self,
        frame: int,
        position: Any,
        velocity: Any,
        fields: Mapping[str, Any] | None = None,
        *,
        rows: Mapping[PointsPrim, tuple[Any, Any]] | None = None,
        pairs: Mapping[LinksPrim, Any] | None = None,
        meshes: Mapping[MeshPrim, tuple[Any, Any, Any]] | None = None,
        poses: Mapping[Shape, tuple[Any, Any]] | None = None,
        notes: Mapping[str, Any] | None = None,
    ) -> None:
        """Write one frame. When it returns, the frame is in its file, whole.

        Args:
            frame: Its time code. The first may be any (0 is the start state), then one by one.
            position: (n, 3) [length], NumPy or Warp; n may be another in every frame.
            velocity: (n, 3) [length per simulated time].
            fields: (n,) or (n, 3) for every name the writer was made with.
            rows: Of every group without indices: its rows (k,) int, and their ids (k,) int.
            pairs: Of all links without pairs: theirs, (m, 2) int rows.
            meshes: Of every surface without indices: points (p, 3) [length], triangles (t, 3) int
                into them, counterclockwise from outside, and normals (p, 3).
            poses: Of every moving shape: translation (3,) [length] and rotation (3, 3).
            notes: Words and numbers to keep in the frame's file, as layer data ``particlesim``.

        Raises:
            ValueError: A frame out of order, arrays of other shapes, values that are missing, or a
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
        checked = self._checker.frame(
            frame, position, velocity, fields, rows, pairs, meshes, poses, notes
        )
        if self._clip is None:
            self._begin(checked)
        if frame > self._planned_end:
            # Twice as far, so that long unplanned runs rewrite the root a few times only.
            self._publish_root(2 * frame)
        clips.fill_clip(self._clip, self._layout, self.info, checked)
        _publish(self._clip, self.clips / f"f.{frame:06d}.usdc")
        self._frame = frame

    def close(self) -> None:
        """Give the root the end that was reached. May be called again."""
        if self._root is not None and not self._closed and self._frame != self._planned_end:
            self._publish_root(self.first if self._frame is None else self._frame)
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

    def _begin(self, frame: Frame) -> None:
        """Everything that has to be on disk before the first frame."""
        self._refuse_unusable()
        self.overwrite = True  # from here on, what exists is this recording's own
        # The old root goes first: it must not lead readers to a mixture of old and new frames.
        self.path.unlink(missing_ok=True)
        files.make_folder("UsdRecorder", self.clips)
        for stale in [*self.clips.glob("f.*.usdc"), *self.clips.glob("manifest.*usda")]:
            stale.unlink()
        clouds = [frame.x[rows] for rows, _ in frame.clouds]
        self.info = stage.sized(self.info, clouds)
        manifest = clips.manifest(self._layout, self.fields, self.info)
        _publish(manifest, self.clips / "manifest.usda")
        self.first = frame.number
        self._root = stage.author_root(self._layout, self.info, self.fields, frame)
        self._publish_root(frame.number + self.info.frames - 1)
        self._clip = _mould(manifest)

    def _go_on(self, last: int) -> None:
        """Take up what is on disk."""
        found = take_up(self.path, self.clips, self._layout, self.info, self.fields, last)
        planned = last + self.info.frames - 1
        self.info, self.first, self.notes = found.info, found.first, found.notes
        self._root, self._clip = found.root, _mould(found.manifest)
        self._planned_end = found.end
        if planned > found.end:
            self._publish_root(planned)

    def _publish_root(self, end: int) -> None:
        stage.set_frames(self._root, self.clips.name, self.first, end)
        _publish(self._root, self.path)
        self._planned_end = end


def _mould(manifest: Sdf.Layer) -> Sdf.Layer:
    """What clips are made of: the declarations, to be filled."""
    clip = Sdf.Layer.CreateAnonymous(".usdc")
    clip.TransferContent(manifest)
    return clip


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
