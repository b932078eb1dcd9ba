"""Pictures by Blender's Cycles, in a process of its own: the best picture, and the slowest."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from pxr import UsdGeom

from ...output import colors
from . import blender
from . import look as looks
from .image import pillow
from .paint import velocity_scale
from .preview import ground_height
from .stage import look_at

INTERPRETER = "BLENDER_PYTHON"
STOPS = 32  # of a colour ramp, Blender's most


def pictures(
    recording: Any, frames: list[float], paint: Any, request: Any, stack: ExitStack
) -> Iterator[np.ndarray]:
    """The pictures of the frames, in order, as they are finished.

    Args:
        recording: An open recording.
        frames: Time codes.
        paint: How to colour.
        request: What the command line asks for: camera, size, samples, interpreter.
        stack: Ends the other process and removes its files.

    Raises:
        ImportError: The interpreter has no ``bpy``. RuntimeError: Blender failed.
    """
    folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="particlesim-")))
    job = folder / "job.json"
    job.write_text(json.dumps(_job(recording, frames, paint, request, folder)))
    python = request.python or os.environ.get(INTERPRETER) or sys.executable
    log = folder / "said.txt"
    with log.open("w", encoding="utf-8") as said:
        try:
            process = subprocess.Popen(
                [python, str(Path(blender.__file__)), str(job)],
                stdout=subprocess.PIPE, stderr=said, text=True,
            )  # fmt: skip
        except OSError as error:
            raise OSError(
                f"render: --python must be an interpreter with bpy, got {python!r} "
                f"({error.strerror}); give the path of one."
            ) from None
    stack.callback(_end, process)
    assert process.stdout is not None
    for line in process.stdout:
        if line.startswith(blender.DONE):
            file = Path(line[len(blender.DONE) :].strip())
            with pillow().open(file) as picture:
                yield np.asarray(picture.convert("RGB"))
            file.unlink()
    if process.wait() != 0:
        _explain(process.returncode, python, log)


def _job(
    recording: Any, frames: list[float], paint: Any, request: Any, folder: Path
) -> dict[str, Any]:
    """What the other process needs to know, as plain values; directions in the stage's space."""
    view = look_at(recording.stage, frames[0], paint)
    cameras = request.viewpoints(recording, frames, view)
    camera = cameras[0]
    look = looks.Look(up=view.up)
    ramp = None
    if paint.color_by is not None:
        table = colors.table(paint.color_map)
        ramp = table[np.linspace(0, len(table) - 1, STOPS).round().astype(int)].tolist()
    return {
        "file": str(recording.path.absolute()),
        "folder": str(folder),
        "frames": frames,
        "width": request.width,
        "height": request.height,
        "samples": request.samples,
        "z_up": UsdGeom.GetStageUpAxis(recording.stage) == UsdGeom.Tokens.z,
        "positions": [each.position.tolist() for each in cameras],
        "axes": camera.axes.tolist(),
        "angle": camera.field_of_view,
        "key": look.key_direction(camera.axes).tolist(),
        "up": view.up.tolist(),
        "ground": ground_height(view, request.ground),
        "size": float(np.linalg.norm(np.ptp(view.geometry.box, axis=0))),
        "background": look.background.tolist(),
        "color_by": paint.color_by,
        "velocity_scale": velocity_scale(recording.stage),
        "color_range": list(paint.color_range),
        "ramp": ramp,
    }


def _explain(code: int, python: str, log: Path) -> None:
    """Raise what the other process failed by."""
    if code == blender.NO_BPY:
        raise ImportError(
            f"render: bpy must be installed for --engine cycles, got none in {python}; "
            "pip install bpy into a Python that it supports, and name that by --python or "
            f"{INTERPRETER}."
        )
    lines = [line for line in log.read_text(errors="replace").splitlines() if line.strip()]
    raise RuntimeError(
        f"render: Blender must finish, got exit code {code} "
        f"({lines[-1] if lines else 'no reason given'}); try --engine warp."
    )


def _end(process: subprocess.Popen[str]) -> None:
    if process.poll() is None:
        process.kill()
    process.wait()
    if process.stdout is not None:
        process.stdout.close()
