"""Films: GIF by Pillow, MP4 by ffmpeg; a file appears whole or not at all."""

from __future__ import annotations

import contextlib
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

import numpy as np

from ...output import files
from .image import pillow

FORMATS = (".gif", ".mp4")
COLORS = 255  # of a GIF's frame
SHORTEST = 2  # hundredths of a second that browsers show a GIF's frame at least


class Film:
    """A file of pictures one after the other.

    Args:
        path: Where to.
        temporary: What to write until it is complete.
        fps: Pictures a second.
    """

    def __init__(self, path: Path, temporary: Path, fps: float):
        self.path, self.temporary, self.fps = path, temporary, fps

    def add(self, array: np.ndarray) -> None:
        """Add a picture, (height, width, 3) uint8."""
        raise NotImplementedError

    def finish(self) -> None:
        """Complete the file under its temporary name."""
        raise NotImplementedError

    def abandon(self) -> None:
        """Let go of what is under way."""


class Gif(Film):
    """A GIF that repeats; the pictures wait in memory, a byte a pixel."""

    def __init__(self, path: Path, temporary: Path, fps: float):
        super().__init__(path, temporary, fps)
        self.module = pillow()
        self.pictures: list[Any] = []

    def add(self, array: np.ndarray) -> None:
        picture = self.module.fromarray(array)
        self.pictures.append(picture.quantize(COLORS, dither=self.module.Dither.NONE))

    def finish(self) -> None:
        # Whole hundredths that together keep the time.
        ends = np.rint(100.0 / self.fps * np.arange(len(self.pictures) + 1))
        shown = np.maximum(np.diff(ends), SHORTEST) * 10.0
        self.pictures[0].save(
            self.temporary, save_all=True, append_images=self.pictures[1:], loop=0,
            duration=shown.astype(int).tolist(), disposal=1, optimize=False,
        )  # fmt: skip


class Mp4(Film):
    """H.264, written while pictures come."""

    def __init__(self, path: Path, temporary: Path, fps: float):
        super().__init__(path, temporary, fps)
        self.program = ffmpeg()
        self.process: subprocess.Popen[bytes] | None = None

    def add(self, array: np.ndarray) -> None:
        if self.process is None:
            self.process = self._start(*array.shape[:2])
        try:
            self._pipe().write(array.tobytes())
        except BrokenPipeError:
            self._failed()

    def finish(self) -> None:
        if self.process is None:
            raise ValueError("Film: frames must be at least one, got none; add a picture.")
        self._pipe().close()
        if self.process.wait() != 0:
            self._failed()

    def abandon(self) -> None:
        if self.process is None:
            return
        self.process.kill()
        self.process.wait()
        for pipe in (self.process.stdin, self.process.stderr):
            with contextlib.suppress(BrokenPipeError):  # what was not yet written is not wanted
                if pipe is not None:
                    pipe.close()

    def _start(self, height: int, width: int) -> subprocess.Popen[bytes]:
        words = [
            self.program, "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24",
            "-s", f"{width}x{height}", "-r", f"{self.fps:.6g}", "-i", "-", "-an",
            # What players read needs even sizes.
            "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-c:v", "libx264", "-pix_fmt", "yuv420p",
            "-crf", "18", "-movflags", "+faststart", str(self.temporary),
        ]  # fmt: skip
        return subprocess.Popen(words, stdin=subprocess.PIPE, stderr=subprocess.PIPE)

    def _pipe(self) -> IO[bytes]:
        assert self.process is not None and self.process.stdin is not None
        return self.process.stdin

    def _failed(self) -> None:
        assert self.process is not None and self.process.stderr is not None
        lines = self.process.stderr.read().decode(errors="replace").splitlines()
        reason = lines[-1] if lines else "no reason given"
        raise OSError(f"Film: ffmpeg must write {self.path}, got {reason!r}; try a .gif.")


def ffmpeg() -> str:
    """The ffmpeg program: the system's, or imageio-ffmpeg's.

    Raises:
        ImportError: There is neither.
    """
    found = shutil.which("ffmpeg")
    if found:
        return found
    try:
        import imageio_ffmpeg
    except ModuleNotFoundError:
        raise ImportError(
            "Film: ffmpeg must be installed for .mp4, got none; "
            "pip install 'particlesim[video]', or write a .gif."
        ) from None
    return imageio_ffmpeg.get_ffmpeg_exe()


@contextlib.contextmanager
def open_film(path: Path, fps: float) -> Iterator[Film]:
    """A film of the kind that the path's suffix says; an error leaves no file."""
    with files.whole("Film", path) as temporary:
        film = (Gif if path.suffix.lower() == ".gif" else Mp4)(path, temporary, fps)
        try:
            yield film
            film.finish()
        finally:
            film.abandon()
