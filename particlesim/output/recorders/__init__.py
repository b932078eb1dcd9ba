"""Recording a simulation, in the format that the output's suffix names."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from ... import validate
from ...engine.source import Source
from ..usd.recorder import UsdRecorder
from .background import BackgroundWriter
from .base import ParticleFrame, ParticleRecorder, Recorder
from .gsd import GsdRecorder
from .npz import NpzRecorder
from .ply import PlyRecorder
from .vtkhdf import VtkhdfRecorder

FORMATS: dict[str, Any] = {
    ".usda": UsdRecorder,
    ".usd": UsdRecorder,
    ".usdc": UsdRecorder,
    ".npz": NpzRecorder,
    ".ply": PlyRecorder,
    ".gsd": GsdRecorder,
    ".vtkhdf": VtkhdfRecorder,
}

__all__ = [
    "FORMATS",
    "BackgroundWriter",
    "GsdRecorder",
    "NpzRecorder",
    "ParticleFrame",
    "ParticleRecorder",
    "PlyRecorder",
    "Recorder",
    "VtkhdfRecorder",
    "open_recorder",
]


def open_recorder(sim: Source, path: str | os.PathLike[str], **options: Any) -> Recorder:
    """The recorder for a file of this suffix.

    Args:
        sim: The simulation.
        path: ``.usda``, ``.usd`` or ``.usdc`` (:class:`~particlesim.output.usd.recorder.UsdRecorder`);
            ``.npz``, ``.ply``, ``.gsd`` or ``.vtkhdf``
            (:class:`~particlesim.output.recorders.base.ParticleRecorder`).
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
    suffix = Path(path).suffix
    if suffix not in FORMATS:
        raise validate.fail(
            "open_recorder", "path", f"end in one of {', '.join(FORMATS)}", str(path),
            "choose one of these",
        )  # fmt: skip
    kind = FORMATS[suffix]
    options = {name: value for name, value in options.items() if value is not None}
    if kind is not UsdRecorder:
        known = ["frames", "fields", "every", "overwrite", "resume"]
        validate.known(f"{kind.__name__}", options, known, "option")
    return kind(sim, path, **options)
