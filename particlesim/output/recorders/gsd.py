"""GSD, the trajectory of HOOMD-blue: one file, read by OVITO.

To recover a file its layout is needed (file layer, version 2). A header of 256 bytes says where a
block of entries is. An entry, 32 bytes, leads to one array of one frame: the frame is its first
number, the array's place in the file the third. Entries are in the order of the frames, and the
block ends at its first blank one. When it is full, a larger copy comes to the end of the file, and
then the header is written anew.
"""

from __future__ import annotations

import contextlib
import os
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np

from .. import files
from .base import KEPT, ParticleFrame, ParticleRecorder

HEADER, ENTRY = 256, 32  # bytes
MAGIC = 0x65DF65DF65DF65DF
ARRAYS = 16  # at most, of the schema's own in a frame
# What the schema has a place for; all else are logged quantities.
KNOWN = {"position": "position", "velocity": "velocity", "group": "typeid", "image": "image"}


class GsdRecorder(ParticleRecorder):
    """Records frames into one GSD file (needs the extra ``gsd``).

    Positions, velocities, groups (as types), masses, diameters and images are where the HOOMD
    schema has them; ``log/particles/id``, ``/world`` and the fields beside, and ``log/time``. The
    box is the periodic one of the frame; on an open axis it is as long as twice the frame's
    positions reach, so that nobody is outside. Positions stay as they are: HOOMD's box is around
    the origin, so that in a periodic one they may lie an image away; unwrapped, position + image *
    box, they are right.

    A frame is appended at the end, and its data come before what leads to them. When the process
    is killed, the frames whose write had returned can be read. A kill may leave a part of the next
    one; it is found, and taken away, when the recording is resumed. Frames that are there already
    are compared and kept.

    Arguments are those of :class:`~particlesim.output.recorders.base.ParticleRecorder`.
    """

    suffix, needs = ".gsd", ("gsd.hoomd", "gsd")

    def __init__(self, *arguments: Any, **options: Any):
        self._library = self.library()
        self._open: Any = None
        self._first = 0
        super().__init__(*arguments, **options)
        self._mass = self.sim.model.column("mass")

    def _capture(self) -> ParticleFrame:
        frame = super()._capture()
        if "image" in self.sim.state:
            frame.columns["image"] = self.sim.get("image")
        return frame

    def files_of(self, number: int) -> list[Path]:
        return [self.path]

    def _begin(self, frame: ParticleFrame) -> None:
        # Prepared under another name, since an empty file is not a trajectory.
        with files.whole(self.owner, self.path, KEPT) as temporary:
            self._library.open(str(temporary), "w", precision=self._precision).close()
        self._first = frame.number
        self._attach()

    def _put(self, frame: ParticleFrame) -> None:
        made = self._frame(frame)
        self._attach()
        place = frame.number - self._first
        if place < len(self._open):
            if self._has(place, made):
                return
            self._detach()
            cut(self.path, place)
            self._attach()
        before = Extent.of(self.path, ARRAYS + len(made.log))
        try:
            self._open.append(made)
            self._open.flush()
            if last_frame(self.path) != place:  # the library tells of most failures, not of all
                raise OSError("no room for what leads to the frame")
        except (OSError, RuntimeError) as error:
            with contextlib.suppress(OSError, RuntimeError):  # of what could not be written
                self._detach()
            before.restore(self.path)
            cut(self.path, place)
            raise files.unwritable(self.owner, self.path, error, KEPT) from error

    def _go_on(self, last: int) -> None:
        if not self.path.is_file():
            raise self._refuse_to_go_on("the file is missing")
        try:
            with self._library.open(str(self.path), "r") as file:
                self._first = int(file[0].configuration.step) // self.every
                found = int(file[last - self._first].configuration.step)
        except (OSError, RuntimeError, IndexError, KeyError) as error:
            raise self._refuse_to_go_on(f"frame {last} cannot be read ({error})") from error
        if found != last * self.every:
            raise self._refuse_to_go_on(f"frame {last} has another number")

    def _finish(self) -> None:
        self._detach()

    @property
    def _precision(self) -> str:
        return "double" if self.sim.settings.precision == "float64" else "single"

    def _attach(self) -> None:
        if self._open is None:
            self._open = self._library.open(str(self.path), "r+", precision=self._precision)

    def _detach(self) -> None:
        if self._open is not None:
            self._open, file = None, self._open
            file.close()

    def _frame(self, frame: ParticleFrame) -> Any:
        made, columns = self._library.Frame(), frame.columns
        made.configuration.step = frame.number * self.every
        made.configuration.box = _box(frame.boxes, columns["position"])
        particles = made.particles
        particles.N = len(columns["position"])
        particles.types = self.group_names
        for name in KNOWN.keys() & columns.keys():
            setattr(particles, KNOWN[name], columns[name])
        particles.diameter = 2.0 * columns["radius"]
        particles.mass = self._mass
        made.log["time"] = np.array([frame.time])
        for name, array in columns.items():
            if name not in KNOWN and name != "radius":
                made.log[f"particles/{name}"] = array
        made.validate()
        return made

    def _has(self, place: int, made: Any) -> bool:
        """Whether the file has this frame already, whole."""
        try:
            found = self._open[place]
        except (OSError, RuntimeError, KeyError):
            return False
        pairs = [(found.configuration.step, made.configuration.step)]
        pairs += [(found.log.get(name), array) for name, array in made.log.items()]
        pairs += [
            (getattr(found.particles, name), getattr(made.particles, name))
            for name in ("N", *KNOWN.values())
        ]
        return all(np.array_equal(np.asarray(a), np.asarray(b)) for a, b in pairs)


def _box(boxes: np.ndarray, x: np.ndarray) -> list[float]:
    """Lengths of the largest box, and no tilts; those of open axes hold all of x."""
    length = boxes.max(axis=0)
    reach = 2.0 * np.abs(x).max(axis=0, initial=0.0)
    single = reach.astype(np.float32)  # as it is written
    reach = np.where(single < reach, np.nextafter(single, np.float32(np.inf)), single)
    open_length = np.where(reach > 0, reach, 1.0)
    return [*np.where(length > 0, length, open_length).tolist(), 0.0, 0.0, 0.0]


# The layout ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Extent:
    """What the library changes when a file grows: the header, the end of the file, and the entries,
    over which it writes when there was no room for a larger block of them.
    """

    header: bytes
    size: int
    where: int
    entries: bytes

    @classmethod
    def of(cls, path: Path, more: int) -> Self:
        """As it is; with the entries if ``more`` could be too many for their block."""
        with open(path, "rb") as file:
            where, length = _block(file.fileno())
            used = _count(file.fileno(), where, length, None)
            full = used + more > length
            entries = os.pread(file.fileno(), ENTRY * used, where) if full else b""
            return cls(file.read(HEADER), os.fstat(file.fileno()).st_size, where, entries)

    def restore(self, path: Path) -> None:
        """Undo what came after."""
        with open(path, "r+b") as file:
            file.write(self.header)
            file.seek(self.where)
            file.write(self.entries)
            file.truncate(self.size)


def last_frame(path: Path) -> int:
    """Number of the last frame that an entry leads to; -1: there is none."""
    with open(path, "rb") as file:
        where, length = _block(file.fileno())
        used = _count(file.fileno(), where, length, None)
        return _entry(file.fileno(), where, used - 1)[0] if used else -1


def cut(path: Path, count: int) -> None:
    """Leave a file its first ``count`` frames: what leads to the others is blanked, in place."""
    with open(path, "r+b") as file:
        where, length = _block(file.fileno())
        used = _count(file.fileno(), where, length, None)
        kept = _count(file.fileno(), where, used, count)
        file.seek(where + ENTRY * kept)
        file.write(bytes(ENTRY * (used - kept)))


def _block(file: int) -> tuple[int, int]:
    """Where the entries are, and for how many there is room."""
    magic, where, length, *_, version = struct.unpack("<5Q2I", os.pread(file, 48, 0))
    if magic != MAGIC or version >> 16 != 2:
        raise OSError(f"a GSD file of version 2 is needed, got version {version >> 16}")
    return where, length


def _entry(file: int, where: int, k: int) -> tuple[int, int]:
    """Frame and place of the k-th entry; zeros where the file ends before it."""
    read = os.pread(file, ENTRY, where + ENTRY * k).ljust(ENTRY, b"\0")
    frame, _, place = struct.unpack_from("<3Q", read)
    return frame, place


def _count(file: int, where: int, length: int, frames: int | None) -> int:
    """How many of the first ``length`` entries are used, for frames below ``frames``; bisection."""
    low, high = 0, length
    while low < high:
        middle = (low + high) // 2
        frame, place = _entry(file, where, middle)
        if place and (frames is None or frame < frames):
            low = middle + 1
        else:
            high = middle
    return low
