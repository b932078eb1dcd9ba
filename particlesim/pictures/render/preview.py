"""Pictures of simulations and of frames of recordings."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ... import validate
from ...engine.source import Source
from ...output import files
from .camera import Camera
from .geometry import Geometry
from .image import FORMATS, Image, pillow
from .look import BACKGROUND, Look
from .overview import overview
from .renderer import Renderer
from .stage import View


def render(
    sim: Source,
    path: str | os.PathLike[str] | None,
    width: int,
    height: int,
    camera: Camera | None,
    color: str | None,
    *,
    color_map: Any = "viridis",
    color_range: tuple[float, float] | None = None,
    worlds: Iterable[int] | None = None,
    groups: Iterable[Any] | None = None,
    layout: Any = "grid",
    surface: Any = False,
    ground: bool | float | None = None,
    background: Any = BACKGROUND,
    shadows: bool = True,
    occlusion: bool = True,
    supersample: int = 2,
    overwrite: bool = False,
) -> Image:
    """A picture of a simulation as it is now (see :meth:`Simulation.render`)."""
    if path is not None:
        files.check_new("Simulation.render", path, overwrite, suffixes=FORMATS)
    if camera is not None and not isinstance(camera, Camera):
        raise TypeError(
            f"Simulation.render: camera must be a Camera, got {camera!r}; use Camera(...)."
        )
    chosen = None if worlds is None else list(worlds)
    several = (sim.model.world_count if chosen is None else len(chosen)) > 1
    view = seen(
        sim, color_by=color, color_map=color_map, color_range=color_range, worlds=chosen,
        groups=groups, layout=layout if several else None, surface=surface,
    )  # fmt: skip
    look = Look(
        view.up, background, ground_height(view, ground), shadows, occlusion,
        supersample=supersample,
    )  # fmt: skip
    if camera is None:
        camera = overview(view.geometry, view.up, width / height)
    image = draw(view.geometry, camera, width, height, look, sim.model.device)
    if path is not None:
        image.save(path, overwrite=overwrite)
    return image


def draw(
    geometry: Geometry, camera: Camera, width: int, height: int, look: Look, device: Any
) -> Image:
    """One picture, by a renderer of its own."""
    renderer = Renderer(device)
    try:
        return renderer.draw(geometry, camera, width, height, look)
    finally:
        renderer.close()


def seen(sim: Source, **recorded: Any) -> View:
    """What there is to see of a simulation: what a recording of it would show.

    Args:
        sim: The simulation.
        **recorded: Options of :class:`~particlesim.output.usd.recorder.UsdRecorder`.
    """
    from ...output.usd.recorder import UsdRecorder
    from ...output.usd.recording import Recording
    from .stage import View, look_at

    if not sim.model.particle_count:
        axis = np.eye(3)["xyz".index(sim.scenes[0].up_axis)]
        return View(Geometry(), axis, None, None)
    with tempfile.TemporaryDirectory(prefix="particlesim-") as folder:
        file = Path(folder) / "frame.usda"
        with UsdRecorder(sim, file, frames=0, **recorded) as recorder:
            recorder.write()
        recording = Recording("Simulation.render", file)
        return look_at(recording.stage, recording.frames()[0])


def ground_height(view: View, ground: bool | float | None) -> float | None:
    """Where the ground of a picture is, along the view's up; None for no ground.

    Args:
        view: What there is to see.
        ground: Its height; True: as low as the boundaries or else anything; None: as low as the
            boundaries, if there are any; False: none.
    """
    if ground is None:
        return view.floor
    if ground is False:
        return None
    if ground is True:
        low, high = view.geometry.box
        lowest = float(np.minimum(low * view.up, high * view.up).sum())
        return lowest if view.floor is None else view.floor
    return validate.number("render", "ground", ground, unit="length")


def notebook_picture(sim: Source) -> bytes | None:
    """A picture as PNG; None where Pillow is missing, so that a notebook shows text instead."""
    try:
        pillow()
    except ImportError:
        return None
    return render(sim, None, 960, 540, None, None).encoded("png")
