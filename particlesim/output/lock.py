"""One writer at a time: the lock that whoever writes an output holds."""

from __future__ import annotations

import contextlib
import glob
import os
import socket
import time
from pathlib import Path

from filelock import FileLock, Timeout

from . import files

PATIENCE = 2.0  # for a lock that is being taken or let go of to say whose it is [s]
PAUSE = 0.01  # between two looks [s]
SPARE = 16384  # bytes that a disk may lose to its blocks and to what leads to a file
SHOWN = 200  # bytes that say who holds a lock; then comes what is reserved


class OutputBusy(BlockingIOError):
    """An output that somebody else is writing."""


class Lock(files.Closing):
    """Holds an output and all that has its stem: ``<stem>.lock`` beside it, removed at the end.

    The system lets go of it when the process ends, however that ends. It says who holds it. What a
    process that was killed has left half written is removed.

    Args:
        owner: Whom an error names.
        path: The output.
        argument: What an error calls the path.

    Raises:
        FileNotFoundError: The folder does not exist. OutputBusy: Somebody else holds it.
        OSError: The folder cannot be written to.

    Example:
        >>> with Lock("Example", Path("out.usda")):
        ...     Path("out.lock").is_file()
        True
        >>> Path("out.lock").exists()
        False
    """

    def __init__(self, owner: str, path: Path, argument: str = "path"):
        files.check_folder(owner, path, argument)
        files.check_writable(owner, path)
        self.owner, self.output, self.path = owner, path, lock_path(path)
        self._reserved = 0  # bytes
        self._lock = FileLock(self.path, thread_local=False)
        latest = time.monotonic() + PATIENCE
        while not self._taken(owner, path):
            holder = _holder(self.path)
            if holder or time.monotonic() > latest:
                raise OutputBusy(
                    f"{owner}: {argument} must be written by one run at a time, got {str(path)!r}, "
                    f"which {holder or 'another process'} is writing; wait for it, or choose "
                    "another."
                )
            time.sleep(PAUSE)
        with contextlib.suppress(OSError):  # it holds without a word too
            self.path.write_text(f"process {os.getpid()} on {socket.gethostname()}\n")
        _remove_unfinished(path)

    def reserve(self, size: int) -> None:
        """Hold room on the disk for what comes at the end, until :meth:`free`.

        Raises:
            OSError: There is none.
        """
        if size <= self._reserved:
            return
        room = 2 * size + SPARE  # it may grow: not every time
        try:
            with open(self.path, "r+b") as file:
                if hasattr(os, "posix_fallocate"):
                    os.posix_fallocate(file.fileno(), SHOWN, room)
                else:  # macOS and Windows; a file that is only made longer may hold no room
                    file.seek(SHOWN)
                    file.write(bytes(room))
        except OSError as error:
            kept = "What was written before is kept."
            raise files.unwritable(self.owner, self.output, error, kept) from error
        self._reserved = room

    def free(self) -> None:
        """Give back the room that was held. May be called again."""
        if self._reserved:
            self._reserved = 0
            with contextlib.suppress(OSError):
                os.truncate(self.path, SHOWN)

    def close(self) -> None:
        """Let go. May be called again."""
        if self._lock.is_locked:
            # While it is held: who takes it after this sees that its file is gone, and looks again.
            with contextlib.suppress(OSError):
                self.path.unlink()
            self._lock.release()

    def _taken(self, owner: str, path: Path) -> bool:
        try:
            self._lock.acquire(timeout=0)
        except Timeout:
            return False
        except OSError as error:
            raise files.unwritable(owner, path, error, remedy="choose another folder") from error
        return True


def lock_path(output: Path) -> Path:
    """Where the lock of an output is."""
    return output.with_suffix(".lock")


def _holder(path: Path) -> str:
    """Who holds a lock, as its file says."""
    with contextlib.suppress(OSError), open(path, "rb") as file:
        return file.read(SHOWN).partition(b"\n")[0].decode(errors="replace")
    return ""


def _remove_unfinished(output: Path) -> None:
    """Remove the temporary files of :func:`.files.whole` that a killed writer has left."""
    any_name = "[0-9a-f]" * 8 + ".tmp"
    stem = glob.escape(output.stem)
    found = [
        *output.parent.glob(f"{stem}.{any_name}{output.suffix}"),
        *output.parent.glob(f"{stem}.checkpoint.{any_name}.npz"),
    ]
    for folder in (output.with_suffix(".clips"), output.with_suffix(".frames")):
        found += folder.glob(f"*.{any_name}.*")
    for each in found:
        with contextlib.suppress(OSError):
            each.unlink()
