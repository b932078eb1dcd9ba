"""USD frames for offline rendering: a root file, and beside it one small file a frame.

``out.usda`` holds what does not change, and tells readers to look for the rest in value clips:
``out.clips/manifest.usda`` and ``out.clips/f.######.usdc``. Every file appears whole, by a
temporary name and ``os.replace``, so that whatever kills the process, finished frames can be read.
Memory does not grow with the number of frames.

What is recorded is described on the host (:mod:`particlesim.output.usd.description`), so that any
source of arrays can be recorded (:mod:`particlesim.output.usd.recorder` does it for simulations).
How the root looks inside is in ``root``, what clips hold in ``samples``.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pxr import Sdf

from .... import validate
from ... import files
from ..description import LinksPrim, MeshPrim, PointsPrim, Shape, StageInfo
from ..layout import MANIFEST, clip_file, clip_folder, layout, set_frames, stale_files
from ..recording import plain_errors
from .frame import Frame, FrameChecker, field_kinds
from .resume import take_up
from .root import author_root, sized
from .samples import fill_clip, manifest

OWNER = "UsdRecorder"
SUFFIXES = (".usda", ".usd", ".usdc")


class UsdWriter(files.Closing):
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
        >>> from particlesim.output.usd.description import PointsPrim
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
        self.clips = clip_folder(self.path)
        self.info = info
        self.fields = field_kinds(fields or {})
        self.overwrite = overwrite or resume is not None
        self._refuse_unusable()
        self._layout = layout(info)
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
        meshes: Mapping[MeshPrim, Any] | None = None,
        poses: Mapping[Shape, tuple[Any, Any]] | None = None,
        notes: Mapping[str, Any] | None = None,
        box: Any = None,
    ) -> None:
        """Write one frame. When it returns, the frame is in its file, whole.

        Args:
            frame: Its time code. The first may be any (0 is the start state), then one by one.
            position: (n, 3) [length], NumPy or Warp; n may be another in every frame.
            velocity: (n, 3) [length per simulated time].
            fields: (n,) or (n, 3) for every name the writer was made with.
            rows: Of every group without indices: its rows (k,) int, and their ids (k,) int.
            pairs: Of all links without pairs: theirs, (m, 2) int rows.
            meshes: Of every surface without triangles: theirs (t, 3) int, counterclockwise from
                outside; without indices, points (p, 3) [length], triangles and normals (p, 3).
            poses: Of every moving shape: translation (3,) [length] and rotation (3, 3).
            notes: Words and numbers to keep in the frame's file, as layer data ``particlesim``.
            box: Of a flexible periodic box its lengths, (3,) [length].

        Raises:
            ValueError: A frame out of order, arrays of other shapes, values that are missing, or a
                value that is not finite (in single precision); the message names frame and
                particle. OSError: The file could not be written. Frames before are kept.
        """
        owner = f"{OWNER}.write"
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
            frame, position, velocity, fields, rows, pairs, meshes, poses, notes, box
        )
        if self._clip is None:
            self._begin(checked)
        if frame > self._planned_end:
            # Twice as far, so that long unplanned runs rewrite the root a few times only.
            self._publish_root(2 * frame)
        fill_clip(self._clip, self._layout, self.info, checked)
        _publish(self._clip, clip_file(self.clips, frame))
        self._frame = frame

    def close(self) -> None:
        """Give the root the end that was reached. May be called again."""
        if self._root is not None and not self._closed and self._frame != self._planned_end:
            self._publish_root(self.first if self._frame is None else self._frame)
        self._closed = True

    def _refuse_unusable(self) -> None:
        files.check_new(OWNER, self.path, self.overwrite, suffixes=SUFFIXES, beside=[self.clips])
        siblings = [self.path.with_suffix(s) for s in SUFFIXES if s != self.path.suffix]
        for sibling in siblings:
            if sibling.exists() and self.clips.exists():
                raise FileExistsError(
                    f"{OWNER}: path must not share its frames with another root, got "
                    f"{str(self.path)!r} next to {sibling.name!r}; choose another name."
                )

    def _begin(self, frame: Frame) -> None:
        """Everything that has to be on disk before the first frame."""
        self._refuse_unusable()
        self.overwrite = True  # from here on, what exists is this recording's own
        # The old root goes first: it must not lead readers to a mixture of old and new frames.
        self.path.unlink(missing_ok=True)
        files.make_folder(OWNER, self.clips)
        for stale in stale_files(self.clips):
            stale.unlink()
        clouds = [frame.x[rows] for rows, _ in frame.clouds]
        self.info = sized(self.info, clouds)
        declared = manifest(self._layout, self.fields, self.info)
        _publish(declared, self.clips / MANIFEST)
        self.first = frame.number
        self._root = author_root(self._layout, self.info, self.fields, frame)
        self._publish_root(frame.number + self.info.frames - 1)
        self._clip = _mould(declared)

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
        set_frames(self._root, self.clips.name, self.first, end)
        _publish(self._root, self.path)
        self._planned_end = end


def _mould(manifest: Sdf.Layer) -> Sdf.Layer:
    """What clips are made of: the declarations, to be filled."""
    clip = Sdf.Layer.CreateAnonymous(".usdc")
    clip.TransferContent(manifest)
    return clip


def _publish(layer: Sdf.Layer, path: Path) -> None:
    """Write a layer so that readers find the old file or the new one, never a part."""
    with files.whole(OWNER, path, "Frames written before are kept.") as temporary, plain_errors():
        layer.Export(str(temporary))
