"""The command render: pictures and films of recordings and scenes."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from .. import validate
from ..output.progress import Meter
from ..pictures.render import film, image
from ..pictures.render.camera import Camera
from .request import OWNER, Request, chosen_frames, parse_numbers
from .shell import (
    USD,
    Color,
    Debug,
    Device,
    Options,
    Overwrite,
    load,
    opened,
    simulation,
)

File = Annotated[str, typer.Argument(metavar="FILE", help="A recording, any USD file, or a scene.")]
Out = Annotated[Path, typer.Option(help="Picture, .png, .jpg, .webp; or film, .gif, .mp4.")]
Frame = Annotated[
    int | None, typer.Option(help="Of a picture. Default: the last; of a scene, the first.")
]
Frames = Annotated[
    str | None, typer.Option(metavar="A:B[:K]", help="Of a film, each K-th. Default: all.")
]
Viewpoint = Annotated[
    str | None,
    typer.Option(
        metavar="PX,PY,PZ,TX,TY,TZ[,ANGLE]",
        help="Position, target, and angle of view [degrees]. Default: the file's own.",
    ),
]
Follow = Annotated[bool, typer.Option("--follow", help="A film's camera goes with the particles.")]
ColorMap = Annotated[str, typer.Option(help="viridis, magma, cubehelix, coolwarm or gray.")]
ColorRange = Annotated[
    str | None, typer.Option(metavar="LOW,HIGH", help="Values with the first and last colour.")
]
Pixels = Annotated[int, typer.Option(min=1, help="Pixels.")]
Ground = Annotated[bool | None, typer.Option(help="A ground. Default: where there are boundaries.")]
Rate = Annotated[
    float | None, typer.Option(help="Pictures a second of a film. Default: the file's.")
]
Engine = Annotated[str, typer.Option(help="warp, or cycles (Blender's, by bpy).")]
Samples = Annotated[int, typer.Option(min=1, help="Of a pixel, by cycles.")]
Interpreter = Annotated[
    str | None, typer.Option(help="Interpreter with bpy. Default: $BLENDER_PYTHON, or this one.")
]


def render(
    file: File,
    out: Out,
    frame: Frame = None,
    frames: Frames = None,
    camera: Viewpoint = None,
    follow: Follow = False,
    color: Color = None,
    color_map: ColorMap = "viridis",
    color_range: ColorRange = None,
    width: Pixels = 1280,
    height: Pixels = 720,
    ground: Ground = None,
    fps: Rate = None,
    engine: Engine = "warp",
    samples: Samples = 64,
    python: Interpreter = None,
    options: Options = None,
    device: Device = None,
    overwrite: Overwrite = False,
    debug: Debug = False,
) -> None:
    """Draw a picture or a film of a recording, or a picture of a scene."""
    with opened(debug) as meter, tempfile.TemporaryDirectory(prefix="particlesim-") as folder:
        request = Request(
            out, frame, frames, camera, follow, color, color_map, color_range, width, height,
            ground, fps, engine, samples, python, device, overwrite,
        )  # fmt: skip
        path = Path(file)
        if path.suffix.lower() in USD:
            from ..engine.start import start_warp

            start_warp(debug)
        elif request.is_film:
            raise validate.fail(
                OWNER, "FILE", "be a recording for a film", file,
                f"run it first: particlesim run {file} --out {path.stem}.usda",
            )  # fmt: skip
        else:
            path = Path(folder) / "frame.usda"
            _record(simulation(load(file, debug), options, device, None), request, path)
        typer.echo(_draw(path, file, request, meter))


def _record(sim: Any, request: Request, path: Path) -> None:
    """Write one frame of a scene."""
    from ..output.usd.recorder import UsdRecorder

    sim.run(frames=request.frame or 0)
    fields = [request.color] if request.color else []
    layout = "grid" if sim.world_count > 1 else None
    with UsdRecorder(sim, path, frames=0, fields=fields, layout=layout) as recorder:
        recorder.write()


def _draw(path: Path, name: str, request: Request, meter: Meter) -> str:
    from ..output.usd.recording import Recording
    from ..pictures.render.paint import Paint, check_field, spanned

    recording = Recording(OWNER, path)
    stage, there = recording.stage, recording.frames() or [0.0]
    frames = chosen_frames(request, there)
    paint = Paint()
    if request.color is not None:
        check_field(stage, request.color)
        limits = request.color_range
        span = (
            spanned(stage, request.color, frames)
            if limits is None
            else parse_numbers("--color-range", limits, (2,), "low,high")
        )
        paint = Paint(request.color, request.color_map, (span[0], span[1]))
    with ExitStack() as stack:
        if request.engine == "cycles":
            from ..pictures.render import cycles

            pictures = cycles.pictures(recording, frames, paint, request, stack)
        else:
            pictures = _pictures(recording, frames, paint, request, stack)
        if not request.is_film:
            (picture,) = pictures
            image.Image(picture).save(request.out, overwrite=request.overwrite)
            return f"frame {frames[0]:g} of {name} drawn in {request.out}"
        step = frames[1] - frames[0] if len(frames) > 1 else 1.0
        fps = request.fps or (stage.GetFramesPerSecond() or 24.0) / step
        with film.open_film(request.out, fps) as made:
            for picture in _counted(pictures, len(frames), meter):
                made.add(picture)
    return f"{len(frames)} frames of {name} drawn in {request.out}, {fps:.4g} a second"


def _pictures(
    recording: Any, frames: list[float], paint: Any, request: Request, stack: ExitStack
) -> Iterator[np.ndarray]:
    """The pictures of the frames, by Warp."""
    from ..output.usd.recording import PORTION, Recording
    from ..pictures.render.look import Look
    from ..pictures.render.preview import ground_height
    from ..pictures.render.renderer import Renderer
    from ..pictures.render.stage import look_at

    renderer = Renderer(request.device)
    stack.callback(renderer.close)
    cameras: list[Camera] = []
    for number, frame in enumerate(frames):
        if number and number % PORTION == 0:  # a stage keeps all clips open that it has read
            recording = Recording(OWNER, recording.path)
        view = look_at(recording.stage, frame, paint)
        look = Look(up=view.up, ground=ground_height(view, request.ground))
        cameras = cameras or request.viewpoints(recording, frames, view)
        size = request.width, request.height
        yield renderer.draw(view.geometry, cameras[number], *size, look).array


def _counted(pictures: Iterable[np.ndarray], count: int, meter: Meter) -> Iterator[np.ndarray]:
    """The pictures, with a bar on a terminal."""
    with meter.count("render") as show:
        for done, picture in enumerate(pictures, start=1):
            yield picture
            show(done, count, "drawing")
