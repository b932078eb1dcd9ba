"""Recordings with a file for every frame, in a folder beside the output.

``out.frames/f.######<suffix>`` are the frames and ``out.frames/index.json`` says what they are of.
Every file appears whole, so that whatever kills the process, finished frames can be read.
"""

from __future__ import annotations

import json
from abc import abstractmethod
from pathlib import Path
from typing import Any

from .. import files
from .base import KEPT, ParticleFrame, ParticleRecorder

FORMAT_VERSION = 1
INDEX = "index.json"


class FolderRecorder(ParticleRecorder):
    """Writes each frame to a file of its own."""

    first = 0

    @property
    def folder(self) -> Path:
        """Where the frames are."""
        return self.path.with_suffix(".frames")

    @property
    def beside(self) -> list[Path]:
        return [self.folder]

    def frame_path(self, number: int) -> Path:
        """The file of a frame."""
        return self.folder / f"f.{number:06d}{self.suffix}"

    def files_of(self, number: int) -> list[Path]:
        return [self.frame_path(number), self.folder / INDEX, self.path]

    @abstractmethod
    def _save(self, path: Path, frame: ParticleFrame) -> None:
        """Write a frame to a file."""

    def _begin(self, frame: ParticleFrame) -> None:
        # What leads readers to the frames goes first: it must not show old and new ones mixed.
        self.path.unlink(missing_ok=True)
        files.make_folder(self.owner, self.folder)
        (self.folder / INDEX).unlink(missing_ok=True)
        for stale in self.folder.glob("f.*"):
            stale.unlink()
        self.first = frame.number
        index = json.dumps(self._index(), indent=1)
        with files.whole(self.owner, self.folder / INDEX, KEPT) as temporary:
            temporary.write_text(index + "\n", encoding="utf-8")

    def _put(self, frame: ParticleFrame) -> None:
        with files.whole(self.owner, self.frame_path(frame.number), KEPT) as temporary:
            self._save(temporary, frame)

    def _index(self) -> dict[str, Any]:
        return {
            "format": f"particlesim frames {self.suffix}",
            "format_version": FORMAT_VERSION,
            **self.identity(),
            "first": self.first,
        }

    def _go_on(self, last: int) -> None:
        try:
            found = json.loads((self.folder / INDEX).read_text(encoding="utf-8"))
            self.first = int(found["first"])
        except (OSError, ValueError, TypeError, KeyError) as error:
            raise self._refuse_to_go_on(f"its index cannot be read ({error})") from error
        if found != self._index():
            raise self._refuse_to_go_on("it was recorded with other settings")
        for number in range(self.first, last + 1):
            path = self.frame_path(number)
            if not path.is_file() or not path.stat().st_size:
                raise self._refuse_to_go_on(f"{path.name} is missing")
