"""Image: a finished picture."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import Any

import numpy as np

from ... import validate

FORMATS = (".png", ".jpg", ".jpeg", ".webp")


class Image:
    """A picture of 8-bit sRGB.

    Args:
        array: (height, width, 3) uint8.

    Example:
        >>> image = Image(np.zeros((2, 3, 3), dtype=np.uint8))
        >>> image.width, image.height
        (3, 2)
        >>> image.save("black.png")
    """

    def __init__(self, array: np.ndarray):
        self.array = array

    @property
    def width(self) -> int:
        """Columns."""
        return self.array.shape[1]

    @property
    def height(self) -> int:
        """Rows."""
        return self.array.shape[0]

    def save(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
        """Write a file, whole or not at all.

        Args:
            path: Ends in ``.png``, ``.jpg`` or ``.webp``.
            overwrite: Replace an existing file.

        Raises:
            FileExistsError: It exists, and ``overwrite`` is not set.
            ImportError: Pillow is not installed.
            ValueError: Another suffix.
        """
        target = check_output("Image.save", path, FORMATS, overwrite)
        temporary = target.with_name(f".{target.name}.tmp")
        try:
            temporary.write_bytes(self.encoded(target.suffix.lower()[1:]))
            os.replace(temporary, target)
        finally:
            temporary.unlink(missing_ok=True)

    def encoded(self, kind: str) -> bytes:
        """The file's bytes, of kind ``png``, ``jpg``, ``jpeg`` or ``webp``."""
        stream = io.BytesIO()
        form = "jpeg" if kind == "jpg" else kind
        pillow().fromarray(self.array).save(stream, format=form)
        return stream.getvalue()

    def _repr_png_(self) -> bytes:
        """For notebooks."""
        return self.encoded("png")

    def __repr__(self) -> str:
        return f"Image({self.width} x {self.height})"


def pillow() -> Any:
    """Pillow's module Image.

    Raises:
        ImportError: It is not installed.
    """
    try:
        from PIL import Image as module
    except ModuleNotFoundError:
        raise ImportError(
            "Image: Pillow must be installed, got none; pip install 'particlesim[render]'."
        ) from None
    return module


def check_output(
    owner: str,
    path: str | os.PathLike[str],
    formats: tuple[str, ...],
    overwrite: bool,
    consent: str = "pass overwrite=True",
) -> Path:
    """The path, if it can be written there: a known suffix, a folder, and nothing to lose."""
    target = Path(path)
    if target.suffix.lower() not in formats:
        raise validate.fail(
            owner, "path", f"end in {', '.join(formats)}", str(path), "choose one of these"
        )
    if not target.parent.is_dir():
        raise FileNotFoundError(
            f"{owner}: path must be in an existing folder, got {str(path)!r}; make it first."
        )
    if target.exists() and not overwrite:
        raise FileExistsError(
            f"{owner}: path must be a new file, got {str(path)!r}, which exists; "
            f"choose another or {consent}."
        )
    return target
