"""Reading NumPy archives (``.npz``) that may hold anything: no more of them than is wanted."""

from __future__ import annotations

import contextlib
import math
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

SLACK = 1 << 24  # bytes that an archive may unpack to beyond its own size
READERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}


@dataclass(frozen=True)
class Stored:
    """An array of an archive: what it is, before it is read."""

    archive: Path
    name: str
    shape: tuple[int, ...]
    dtype: np.dtype

    @classmethod
    def find(cls, file: zipfile.ZipFile, name: str) -> Stored:
        """What an archive has by this name.

        Raises:
            Exception: No plain array that is as long as its shape says.
        """
        entry = file.getinfo(f"{name}.npy")
        with file.open(entry) as opened:
            version = np.lib.format.read_magic(opened)
            shape, _, dtype = READERS[version](opened)
            length = opened.tell() + math.prod(shape) * dtype.itemsize
        if dtype.hasobject or any(n < 0 for n in shape) or length != entry.file_size:
            raise ValueError(f"{name} is {dtype} {shape} in {entry.file_size} bytes")
        return cls(Path(str(file.filename)), name, shape, dtype)

    def read(self) -> np.ndarray:
        """The array; reading it to its end has its checksum compared."""
        with opened(self.archive) as file, file.open(f"{self.name}.npy") as entry:
            array = np.lib.format.read_array(entry, allow_pickle=False)
            if entry.read() or (array.shape, array.dtype) != (self.shape, self.dtype):
                raise ValueError(f"{self.name} has changed")
            return array


@contextlib.contextmanager
def opened(path: Path) -> Iterator[zipfile.ZipFile]:
    """The archive, unless it says that it unpacks to much more than it is.

    Raises:
        Exception: Whatever its bytes lead to.
    """
    with zipfile.ZipFile(path) as file:
        unpacked = sum(entry.file_size for entry in file.infolist())
        if unpacked > path.stat().st_size + SLACK:
            raise ValueError(f"it unpacks to {unpacked:,} bytes")
        yield file


def is_whole(value: Any, below: int) -> bool:
    """Whether a value of JSON is a whole number from 0 on, and less than that."""
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < below
