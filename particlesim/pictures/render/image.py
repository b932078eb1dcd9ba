"""Image: a finished picture."""

from __future__ import annotations

import io
import os
from typing import Any

import numpy as np

from ... import validate
from ...output import files

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
        target = files.check_new("Image.save", path, overwrite, suffixes=FORMATS)
        content = self.encoded(target.suffix.lower()[1:])
        with files.whole("Image.save", target) as temporary:
            temporary.write_bytes(content)

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
    return validate.installed("Image", "PIL.Image", "render")
