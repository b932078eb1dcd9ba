"""The layout of GSD files (file layer, version 2), as far as recovering them needs it.

A header of 256 bytes says where a block of entries is. An entry, 32 bytes, leads to one array of
one frame: the frame is its first number, the array's place in the file the third. Entries are in
the order of the frames, and the block ends at its first blank one. When it is full, a larger copy
comes to the end of the file, and then the header is written anew.
"""

from __future__ import annotations

import os
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Self

HEADER, ENTRY = 256, 32  # bytes
MAGIC = 0x65DF65DF65DF65DF


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
