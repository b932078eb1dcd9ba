"""The commands render, view and plot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from ..output.progress import Meter
from .scene_files import load_scene
from .shell import (
    DEFAULT_FRAMES,
    Debug,
    Device,
    Frames,
    Options,
    Overwrite,
    Precision,
    Substeps,
    Worlds,
    assigned,
    one_line_errors,
    simulation,
    start_warp_quietly,
)


def render(
    file: Annotated[
        str, typer.Argument(metavar="FILE", help="A recording, any USD file, or a scene.")
    ],
    out: Annotated[Path, typer.Option(help="Picture, .png, .jpg, .webp; or film, .gif, .mp4.")],
    frame: Annotated[
        int | None, typer.Option(help="Of a picture. Default: the last; of a scene, the first.")
    ] = None,
    frames: Annotated[
        str | None, typer.Option(metavar="A:B[:K]", help="Of a film, each K-th. Default: all.")
    ] = None,
    camera: Annotated[
        str | None,
        typer.Option(
            metavar="PX,PY,PZ,TX,TY,TZ[,ANGLE]",
            help="Position, target, and angle of view [degrees]. Default: the file's own.",
        ),
    ] = None,
    color: Annotated[
        str | None, typer.Option(metavar="NAME", help="Colour by this value, as density or speed.")
    ] = None,
    color_map: Annotated[
        str, typer.Option(help="viridis, magma, cubehelix, coolwarm or gray.")
    ] = "viridis",
    color_range: Annotated[
        str | None, typer.Option(metavar="LOW,HIGH", help="Values with the first and last colour.")
    ] = None,
    width: Annotated[int, typer.Option(min=1, help="Pixels.")] = 1280,
    height: Annotated[int, typer.Option(min=1, help="Pixels.")] = 720,
    ground: Annotated[
        bool | None, typer.Option(help="A ground. Default: where there are boundaries.")
    ] = None,
    fps: Annotated[
        float | None, typer.Option(help="Pictures a second of a film. Default: the file's.")
    ] = None,
    engine: Annotated[str, typer.Option(help="warp, or cycles (Blender's, by bpy).")] = "warp",
    samples: Annotated[int, typer.Option(min=1, help="Of a pixel, by cycles.")] = 64,
    python: Annotated[
        str | None,
        typer.Option(help="Interpreter with bpy. Default: $BLENDER_PYTHON, or this one."),
    ] = None,
    options: Options = None,
    device: Device = None,
    overwrite: Overwrite = False,
    debug: Debug = False,
) -> None:
    """Draw a picture or a film of a recording, or a picture of a scene."""
    meter = Meter()
    with one_line_errors(meter, debug):
        from . import render as command

        request = command.Request(
            out, frame, frames, camera, color, color_map, color_range, width, height, ground, fps,
            engine, samples, python, device, overwrite,
        )  # fmt: skip
        if not debug:
            start_warp_quietly()

        def simulate() -> Any:
            return simulation(load_scene(file), options or [], device, None)

        typer.echo(command.render(file, request, meter, simulate))


def view(
    file: Annotated[
        str, typer.Argument(metavar="FILE", help="A recording, any USD file, or a scene to run.")
    ],
    port: Annotated[int, typer.Option(help="Port of the page. Default: any that is free.")] = 0,
    browser: Annotated[bool, typer.Option(help="Open a browser, or only say where.")] = True,
    color: Annotated[
        str | None, typer.Option(metavar="NAME", help="Colour by this value, as density or speed.")
    ] = None,
    frames: Frames = None,
    options: Options = None,
    device: Device = None,
    worlds: Worlds = None,
    precision: Precision = None,
    substeps: Substeps = None,
    debug: Debug = False,
) -> None:
    """Show a recording in the browser, or run a scene there.

    The page is on this computer only.
    """
    with one_line_errors(Meter(), debug):
        from . import view as command

        def simulate() -> tuple[Any, int]:
            if not debug:
                start_warp_quietly()
            module = load_scene(file)
            assignments = assigned(options, precision, substeps)
            sim = simulation(module, assignments, device, worlds)
            wanted = getattr(module, "frames", DEFAULT_FRAMES) if frames is None else frames
            return sim, wanted

        command.view(file, port, browser, color, simulate, typer.echo)


def plot(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="What run --history wrote.")],
    out: Annotated[
        Path | None, typer.Option(help="Picture, .png, .svg or .pdf. Default: beside the file.")
    ] = None,
    what: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,...",
            help="energy, drift, momentum, angular_momentum, potential, density, residual. "
            "Default: all there are.",
        ),
    ] = None,
    overwrite: Overwrite = False,
    debug: Debug = False,
) -> None:
    """Draw what a run recorded over time."""
    with one_line_errors(Meter(), debug):
        from ..output.history.plots import plot_history

        picture = file.with_suffix(".png") if out is None else out
        names = [word.strip() for word in what.split(",")] if what else None
        drawn = plot_history(file, picture, names, overwrite=overwrite)
        typer.echo(f"{', '.join(drawn)} of {file} drawn in {picture}")
