"""Recording a simulation, in the format that the output's suffix names."""

from __future__ import annotations

import importlib
import os
from pathlib import Path
from typing import Any

from ... import validate
from ...engine.source import Source
from .base import ParticleRecorder, Recorder

# Suffix to module, in output, and class. A module is imported when its first file is opened.
FORMATS = {
    ".usda": "usd.recorder.UsdRecorder",
    ".usd": "usd.recorder.UsdRecorder",
    ".usdc": "usd.recorder.UsdRecorder",
    ".npz": "recorders.npz.NpzRecorder",
    ".ply": "recorders.ply.PlyRecorder",
    ".gsd": "recorders.gsd.GsdRecorder",
    ".vtkhdf": "recorders.vtkhdf.VtkhdfRecorder",
}


def recorder_class(path: str | os.PathLike[str]) -> type[Recorder]:
    """What records into a file of this suffix, with all that it needs.

    Raises:
        ValueError: Another suffix. ImportError: It needs a package that is not installed.
    """
    suffix = Path(path).suffix
    if suffix not in FORMATS:
        raise validate.fail(
            "open_recorder", "path", f"end in one of {', '.join(FORMATS)}", str(path),
            "choose one of these",
        )  # fmt: skip
    module, _, name = FORMATS[suffix].rpartition(".")
    kind: type[Recorder] = getattr(importlib.import_module(f"..{module}", __name__), name)
    kind.library()
    return kind


def open_recorder(sim: Source, path: str | os.PathLike[str], **options: Any) -> Recorder:
    """The recorder for a file of this suffix.

    Args:
        sim: The simulation.
        path: ``.usda``, ``.usd`` or ``.usdc`` (:class:`~particlesim.UsdRecorder`); ``.npz``,
            ``.ply``, ``.gsd`` or ``.vtkhdf`` (:class:`.ParticleRecorder`).
        **options: Further arguments of the recorder.

    Raises:
        ValueError: Another suffix. TypeError: An option that the format does not have.

    Example:
        >>> from particlesim import Scene, Simulation
        >>> scene = Scene()
        >>> ball = scene.add_particles([(0, 1, 0)])
        >>> with open_recorder(Simulation(scene, device="cpu"), "ball.npz") as recorder:
        ...     recorder.write()
    """
    kind = recorder_class(path)
    options = {name: value for name, value in options.items() if value is not None}
    if issubclass(kind, ParticleRecorder):
        known = ["frames", "fields", "every", "overwrite", "resume"]
        validate.known(kind.__name__, options, known, "option")
    return kind(sim, path, **options)
