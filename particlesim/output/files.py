"""Files that appear whole or not at all, whatever ends the process that writes them."""

from __future__ import annotations

import contextlib
import os
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np


@contextlib.contextmanager
def whole(owner: str, target: Path, kept: str) -> Iterator[Path]:
    """Yield a temporary name beside ``target``; what was written there then takes its place.

    Args:
        owner: Whom an error names.
        target: The file; readers find the old one or the new one, never a part.
        kept: What an error says about what was written before.

    Raises:
        OSError: The file could not be written; the temporary one is gone, the old one stands.
    """
    temporary = target.with_name(f"{target.stem}.tmp{target.suffix}")
    try:
        yield temporary
        os.replace(temporary, target)
    except BaseException as error:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        if not isinstance(error, OSError):
            raise
        raise type(error)(
            f"{owner}: {str(target)!r} must be writable, got {error}; free some space or "
            f"choose another folder. {kept}"
        ) from error


def make_folder(owner: str, folder: Path) -> None:
    """Make a folder, if it is not there.

    Raises:
        OSError: It cannot be made.
    """
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise type(error)(
            f"{owner}: {str(folder)!r} must be writable, got {error}; choose another folder."
        ) from error


def write_arrays(path: Path, arrays: Mapping[str, Any], *, sync: bool = False) -> None:
    """Write a NumPy archive (``.npz``); the same arrays give the same bytes.

    Args:
        path: The file.
        arrays: By name; numbers become arrays of no dimension.
        sync: Return only when the disk has it, so that it outlives a loss of power.
    """
    with open(path, "wb") as file:
        with zipfile.ZipFile(file, "w") as archive:
            for name, array in arrays.items():
                # Without a date, which would differ from run to run.
                entry = zipfile.ZipInfo(f"{name}.npy")
                with archive.open(entry, "w", force_zip64=True) as opened:
                    np.lib.format.write_array(opened, np.asarray(array), allow_pickle=False)
        file.flush()
        if sync:
            os.fsync(file.fileno())
