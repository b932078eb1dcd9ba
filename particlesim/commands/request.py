"""What is asked of the command render: pictures or a film, of which frames, from where."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .. import validate
from ..output import files
from ..pictures.render import film, image
from ..pictures.render.camera import FIELD_OF_VIEW, Camera

OWNER = "render"
ENGINES = ("warp", "cycles")


@dataclass(frozen=True)
class Request:
    """What the command line asks for; see its help."""

    out: Path
    frame: int | None = None
    frames: str | None = None
    camera: str | None = None
    follow: bool = False
    color: str | None = None
    color_map: str = "viridis"
    color_range: str | None = None
    width: int = 1280
    height: int = 720
    ground: bool | None = None
    fps: float | None = None
    engine: str = "warp"
    samples: int = 64
    python: str | None = None
    device: str | None = None
    overwrite: bool = False

    def __post_init__(self) -> None:
        validate.choice(OWNER, "engine", self.engine, ENGINES)
        formats = (*image.FORMATS, *film.FORMATS)
        files.check_new(
            OWNER, self.out, self.overwrite, suffixes=formats, consent="give --overwrite"
        )
        if not self.is_film and self.frames is not None:
            raise validate.fail(
                OWNER, "--frames", "be of a film, .gif or .mp4", str(self.out),
                "give --frame for one picture",
            )  # fmt: skip
        if self.is_film and self.frame is not None:
            raise validate.fail(
                OWNER, "--frame", "be of one picture", str(self.out), "give --frames a:b for a film"
            )
        if self.follow and not self.is_film:
            raise validate.fail(
                OWNER, "--follow", "be of a film, .gif or .mp4", str(self.out),
                "leave it out for one picture",
            )  # fmt: skip
        # What is missing is better known before the work.
        if self.out.suffix.lower() == ".mp4":
            film.ffmpeg()
        else:
            image.pillow()

    @property
    def is_film(self) -> bool:
        """Whether many pictures are asked for."""
        return self.out.suffix.lower() in film.FORMATS

    def viewpoints(self, recording: Any, frames: list[float], view: Any) -> list[Camera]:
        """The camera of each frame: as asked for, or the file's own, or one that sees all frames.

        The own one of a recording gives way in films whose particles leave its picture.

        Args:
            recording: An open recording.
            frames: Time codes of the pictures.
            view: What there is to see in the first of them.
        """
        from ..output.usd.recording import notes
        from ..pictures.render.stage import follow, overlook

        aspect, asked = self.width / self.height, self._asked(view)
        if self.follow:
            return follow(recording, frames, aspect, asked)
        # The camera that a recorder put there knew the first frame only.
        fixed = None if self.is_film and notes(recording.stage) else view.camera
        camera = asked or fixed or overlook(recording, frames, aspect, view.camera)
        return [camera] * len(frames)

    def _asked(self, view: Any) -> Camera | None:
        """The camera of the option."""
        if self.camera is None:
            return None
        numbers = parse_numbers("--camera", self.camera, (6, 7), "px,py,pz,tx,ty,tz[,angle]")
        angle = numbers[6] if len(numbers) == 7 else FIELD_OF_VIEW
        return Camera(numbers[:3], numbers[3:6], view.up, angle)


def chosen_frames(request: Request, there: list[float]) -> list[float]:
    """The frames asked for, of those that are there; of a picture the last."""
    if not request.is_film:
        if request.frame is None or len(there) == 1:
            return there[-1:]
        if request.frame not in there:
            raise validate.fail(
                OWNER, "--frame", f"be from {there[0]:g} to {there[-1]:g}", request.frame,
                "choose one that is there",
            )  # fmt: skip
        return [float(request.frame)]
    if request.frames is None:
        return there
    words = request.frames.split(":")
    try:
        first, last, step = ([int(w) if w else None for w in words] + [None] * 2)[:3]
        if len(words) not in (2, 3) or (step is not None and step < 1):
            raise ValueError
    except ValueError:
        raise validate.fail(
            OWNER, "--frames", "be first:last or first:last:step", request.frames, "as 0:120"
        ) from None
    low, high = first or 0, there[-1] if last is None else last
    frames = [f for f in there if (first is None or f >= low) and f <= high][:: step or 1]
    if not frames:
        raise validate.fail(
            OWNER, "--frames", f"hold some of {there[0]:g} to {there[-1]:g}", request.frames,
            "choose some that are there",
        )  # fmt: skip
    return frames


def parse_numbers(option: str, text: str, counts: tuple[int, ...], form: str) -> list[float]:
    """Numbers with commas between them, as many as one of ``counts``."""
    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in counts or not np.isfinite(numbers).all():
        raise validate.fail(OWNER, option, f"be {form}", text, "give numbers with commas between")
    return numbers
