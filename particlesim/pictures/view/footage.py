"""Footage: a recording, also one that still grows, as packets for the page."""

from __future__ import annotations

import os
import threading
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ... import validate
from ...output import colors
from ...output.usd.recording import PORTION, Recording, notes, quiet, up_axis
from ..render.overview import overview
from ..render.paint import Paint, field_names, scanned, spanned
from ..render.stage import look_at
from . import cast
from .packet import packed
from .shot import Shot

OWNER = "view"
LEGEND = 32  # steps of a colour map that the page shows
WIDE = 16 / 9  # of a page, roughly


@dataclass(frozen=True)
class Choice:
    """What of a frame is asked for, and how.

    Args:
        world: Number of the one world to show; None: all.
        apart: Put worlds that are in one place side by side.
        paint: The colours.
    """

    world: int | None = None
    apart: bool = False
    paint: Paint = field(default_factory=Paint)


class Footage:
    """A USD file for the page. Threads may share it: one reads at a time.

    Args:
        path: The file.

    Raises:
        FileNotFoundError: There is no such file. ValueError: It cannot be read as USD.
    """

    def __init__(self, path: Path):
        self.path, self.take = path, 0
        self._lock = threading.RLock()
        self._recording: Recording | None = None
        self._start()

    def scene(self) -> dict[str, Any]:
        """All that the page has to know before the first frame."""
        with self._lock, quiet():
            stage = self._fresh().stage
            first = look_at(stage, self._first)
            camera = first.camera or overview(first.geometry, first.up, WIDE)
            fps = stage.GetTimeCodesPerSecond() or 24.0
            return {
                "title": self.path.name,
                "take": self.take,
                "frames": self.frames,
                "fps": fps,
                "frameTime": notes(stage).get("frameTime", 1.0 / fps),
                "up": first.up.tolist(),
                "floor": first.floor,
                "camera": {
                    "position": camera.position.tolist(),
                    "target": camera.target.tolist(),
                    "angle": camera.field_of_view,
                },
                "worlds": self.worlds,
                "coinciding": cast.coinciding(stage, self.worlds),
                "groups": [
                    {**group, "color": _shown(group["color"])}
                    for group in cast.groups(stage, self.cast)
                ],
                "fields": field_names(stage),
                "maps": {
                    name: _shown(
                        colors.table(name)[np.linspace(0, colors.STEPS - 1, LEGEND, dtype=int)]
                    )
                    for name in colors.MAPS
                },
            }

    def refresh(self) -> None:
        """Notice what others have written since: more frames, or another recording."""
        with self._lock, quiet():
            if _modified(self.path) != self._written:
                self._recording = None  # or the old file would be read again
                self.take += 1
                self._start()
            else:
                self._list()

    def packet(self, frame: float, choice: Choice) -> bytes:
        """What changes from frame to frame, as it is in one of them.

        Raises:
            LookupError: There is no such frame. ValueError: A file of it cannot be read.
        """
        return self._packet(frame, choice, still=False)

    def still(self, choice: Choice) -> bytes:
        """What is the same in every frame."""
        return self._packet(self.frames[0], choice, still=True)

    def span(self, name: str) -> tuple[float, float]:
        """The range that a colour map should span for a value, by a few frames of all."""
        with self._lock, quiet():
            self.check_field(name)
            recording = self._fresh()
            good = [frame for frame in scanned(self.frames) if not recording.damaged(frame)]
            return spanned(recording.stage, name, good)

    def check_field(self, name: str) -> None:
        """Refuse a name that there are no values of."""
        validate.choice(OWNER, "color", name, field_names(self._fresh().stage))

    def _start(self) -> None:
        """Read what there is, as if for the first time."""
        written = _modified(self.path)
        with quiet():
            self._recording = recording = Recording(OWNER, self.path)
            self._clips = {str(clip.path): clip.frame for clip in recording.clips}
            self.frames = recording.frames() or [0.0]
            self.cast = cast.cast(recording.stage)
        self.worlds = sorted({m.world for m in self.cast if m.world is not None})
        self._shifts: dict[int, np.ndarray] | None = None
        self._known, self._read, self._written = set(self.frames), 0, written

    def _list(self) -> None:
        """Look which clips have come: whole folders, for there may be many."""
        folders = filter(os.path.isdir, {os.path.dirname(path) for path in self._clips})
        there = {file.path for folder in folders for file in os.scandir(folder)}
        found = {frame for path, frame in self._clips.items() if path in there}
        self.frames = sorted(found) or self.frames

    def _fresh(self, frame: float | None = None) -> Recording:
        """The recording, opened anew where it has to be.

        A stage keeps all clips open that it has read, and does not see those that came later.
        """
        self._read += 1
        unseen = frame is not None and frame not in self._known
        if self._recording is None or self._read > PORTION or unseen:
            self._recording, self._read = None, 1
            self._recording = Recording(OWNER, self.path)
            self._known = set(self.frames)
        return self._recording

    def _packet(self, frame: float, choice: Choice, still: bool) -> bytes:
        with self._lock, quiet():
            if not still:
                self._refuse(frame)
            world = choice.world
            if world is not None and world not in self.worlds:
                raise validate.fail(
                    OWNER, "world", "be one that is there", world, "look at the list"
                )
            shifts = self._places() if choice.apart and world is None else {}
            shot = Shot(self._fresh(frame).stage, frame, choice.paint)
            for member in self.cast:
                if member.still == still and (world is None or member.world in (None, world)):
                    shot.add(member, None if member.world is None else shifts.get(member.world))
            return packed(frame, shot.layers, shot.edges())

    def _refuse(self, frame: float) -> None:
        """Say what is wrong with a frame that cannot be shown."""
        if frame not in self.frames:
            raise LookupError(
                f"{OWNER}: frame must be from {self.frames[0]:g} to {self.frames[-1]:g}, "
                f"got {frame:g}; choose one that is there."
            )
        damaged = self._fresh().damaged(frame)
        if damaged:
            raise validate.fail(
                OWNER, f"frame {frame:g}", "have a file that can be read to its end",
                damaged.name, "record it again, or go on with run --resume",
            )  # fmt: skip

    @property
    def _first(self) -> float:
        """The first frame that can be read."""
        recording = self._fresh()
        return next((f for f in self.frames if not recording.damaged(f)), self.frames[0])

    def _places(self) -> dict[int, np.ndarray]:
        """Where worlds go that are in one place; as the first frame needs it."""
        if self._shifts is None:
            stage, boxes = self._fresh().stage, {}
            for world in self.worlds:
                shot = Shot(stage, self._first, Paint())
                for member in self.cast:
                    if member.world == world:
                        shot.add(member, None)
                boxes[world] = shot.box if shot.box is not None else np.zeros((2, 3))
            self._shifts = cast.side_by_side(boxes, up_axis(stage))
        return self._shifts


def _modified(path: Path) -> tuple[int, int]:
    """When a file or folder was changed last [ns], and its number; zeros: it is not there."""
    try:
        found = path.stat()
    except FileNotFoundError:
        return 0, 0
    return found.st_mtime_ns, found.st_ino


def _shown(linear: Any) -> list:
    """Linear colours as sRGB, 0..255."""
    return np.rint(255 * colors.encoded(np.asarray(linear, dtype=float))).astype(int).tolist()
