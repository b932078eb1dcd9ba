"""Files that appear whole or not at all, and the refusal of those that would be lost."""

from __future__ import annotations

import contextlib
import os
import secrets
import tempfile
import zipfile
from abc import ABC, abstractmethod
from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Self

import numpy as np

from .. import validate

FREE = "free some space or choose another folder"


class OutputExists(FileExistsError, ValueError):
    """An output would replace what is there: a fault of the disk as much as of the argument."""


def check_new(
    owner: str,
    path: str | os.PathLike[str],
    overwrite: bool,
    *,
    suffixes: Collection[str] = (),
    beside: Iterable[Path] = (),
    argument: str = "path",
    consent: str = "pass overwrite=True",
) -> Path:
    """The path, if an output can be written there and nothing is lost; before any work is done.

    Args:
        owner: Whom an error names.
        path: The output.
        overwrite: What exists may be replaced.
        suffixes: What the name may end in, in either case; none: anything.
        beside: Further files and folders that the output is made of.
        argument: What an error calls the path.
        consent: How an error says to ask for replacing.

    Raises:
        ValueError: Another suffix. FileNotFoundError: The folder does not exist.
        IsADirectoryError: The path is a folder. OutputExists: Something of the output exists.

    Example:
        >>> check_new("History", "run.csv", False, suffixes=(".csv", ".jsonl")).name
        'run.csv'
    """
    target, shown = Path(path), str(path)
    if suffixes and target.suffix.lower() not in suffixes:
        raise validate.fail(owner, argument, f"end in {', '.join(suffixes)}", shown, "name it so")
    check_folder(owner, target, argument)
    if target.is_dir():
        raise IsADirectoryError(
            f"{owner}: {argument} must be a file, got the folder {shown!r}; choose another name."
        )
    existing = () if overwrite else [each for each in (target, *beside) if each.exists()]
    if existing:
        raise OutputExists(
            f"{owner}: {argument} must be a new file, got {shown!r} where {existing[0].name!r} "
            f"exists; choose another, or {consent}."
        )
    return target


def check_folder(owner: str, target: Path, argument: str = "path") -> None:
    """Refuse a file in a folder that does not exist.

    Raises:
        FileNotFoundError: It does not.
    """
    if not target.parent.is_dir():
        raise FileNotFoundError(
            f"{owner}: {argument} must be in an existing folder, got {str(target)!r}; "
            f"make {str(target.parent)!r} first."
        )


def check_writable(owner: str, target: Path, remedy: str = "choose another folder") -> None:
    """Refuse a file in a folder that takes none; tried, since permissions do not say it all.

    Raises:
        OSError: No file can be made there.
    """
    try:
        tempfile.TemporaryFile(dir=target.parent).close()
    except OSError as error:
        raise unwritable(owner, target, error, remedy=remedy) from error


@contextlib.contextmanager
def whole(owner: str, target: Path, kept: str = "") -> Iterator[Path]:
    """Yield a temporary name beside ``target``; what was written there then takes its place.

    Args:
        owner: Whom an error names.
        target: The file; readers find the old one or the new one, never a part.
        kept: What an error says about what was written before.

    Raises:
        OSError: The file could not be written; the temporary one is gone, the old one stands.
    """
    temporary = target.with_name(f"{target.stem}.{secrets.token_hex(4)}.tmp{target.suffix}")
    try:
        yield temporary
        os.replace(temporary, target)
    except BaseException as error:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        if not isinstance(error, OSError):
            raise
        raise unwritable(owner, target, error, kept) from error


def unwritable(
    owner: str, target: Path, error: Exception, kept: str = "", remedy: str = FREE
) -> OSError:
    """The error of a file that could not be written, for the caller to raise; ``kept`` as above."""
    kind = type(error) if isinstance(error, OSError) else OSError
    return kind(f"{owner}: {str(target)!r} must be writable, got {error}; {remedy}. {kept}".strip())


def make_folder(owner: str, folder: Path) -> None:
    """Make a folder, if it is not there.

    Raises:
        OSError: It cannot be made.
    """
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise unwritable(owner, folder, error, remedy="choose another folder") from error


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


def sync(paths: Iterable[Path]) -> None:
    """Return only when the disk has these files, those that exist, and their names.

    Raises:
        OSError: It cannot take them.
    """
    paths = list(paths)
    folders = {path.parent for path in paths} if hasattr(os, "O_DIRECTORY") else set()
    for path in (*filter(Path.is_file, paths), *folders):
        opened = os.open(path, os.O_RDONLY)
        try:
            os.fsync(opened)
        finally:
            os.close(opened)


class Closing(ABC):
    """Something to be closed at the end of a ``with``; of several errors the first is raised."""

    @abstractmethod
    def close(self) -> None:
        """Finish. May be called again."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> None:
        try:
            self.close()
        except Exception:
            if error is None:
                raise
