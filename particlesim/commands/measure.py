"""The commands tradeoff, tune and stress."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..output.progress import Meter
from .scene_files import label, load_scene
from .shell import (
    Debug,
    Device,
    Frames,
    Options,
    Overwrite,
    SceneName,
    Worlds,
    one_line_errors,
    start_warp_quietly,
)


def tradeoff(
    scene: SceneName,
    vary: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUE,...", help="Values of a setting or option; repeat."),
    ] = None,
    options: Options = None,
    frames: Frames = None,
    repeats: Annotated[int, typer.Option(min=1, help="Timed runs of each setting.")] = 3,
    error: Annotated[
        str | None,
        typer.Option(help="known, converged, energy or momentum. Default: known if it is."),
    ] = None,
    reference: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUE", help="What the converged reference takes; repeat."),
    ] = None,
    bound: Annotated[float | None, typer.Option(help="Error that counts as diverged.")] = None,
    plot: Annotated[Path | None, typer.Option(help="Picture to draw, .png, .svg, .pdf.")] = None,
    save: Annotated[Path | None, typer.Option(help="Table to write, .json or .csv.")] = None,
    device: Device = None,
    overwrite: Overwrite = False,
    debug: Debug = False,
) -> None:
    """Measure what settings cost, and how accurate they are."""
    meter = Meter()
    with one_line_errors(meter, debug):
        from . import tradeoff as command

        command.check_outputs({"--plot": plot, "--save": save}, overwrite)
        if not debug:
            start_warp_quietly()
        table = command.sweep(
            load_scene(scene), options or (), vary or (), error, reference or (), meter,
            frames=frames, repeats=repeats, bound=bound, device=device,
        )  # fmt: skip
        typer.echo(str(table))
        command.write(table, plot, save)


def tune(
    scene: SceneName,
    error: Annotated[float, typer.Option(help="The error to stay under.")] = 1e-3,
    by: Annotated[
        str | None,
        typer.Option(help="known, converged, energy or momentum. Default: known if it is."),
    ] = None,
    vary: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUE,...", help="Values of a setting or option; repeat."),
    ] = None,
    options: Options = None,
    frames: Frames = None,
    seeds: Annotated[int, typer.Option(min=1, help="Seeds to try everything with.")] = 3,
    device: Device = None,
    debug: Debug = False,
) -> None:
    """Find the cheapest settings under an error, and print them as Python."""
    meter = Meter()
    with one_line_errors(meter, debug):
        from . import tune as command

        if not debug:
            start_warp_quietly()
        found = command.search(
            load_scene(scene), options or (), vary or (), by, meter,
            error=error, frames=frames, seeds=seeds, device=device,
        )  # fmt: skip
        typer.echo(str(found))


def stress(
    scene: SceneName,
    options: Options = None,
    frames: Annotated[int, typer.Option(min=1, help="Frames of each case.")] = 5,
    tolerance: Annotated[
        float, typer.Option(help="Difference from a finer run that still counts as right.")
    ] = 0.2,
    device: Device = None,
    worlds: Worlds = None,
    debug: Debug = False,
) -> None:
    """Run a scene at the extremes, and say where it held, refused, recovered or failed."""
    meter = Meter()
    with one_line_errors(meter, debug):
        from . import stress as command

        if not debug:
            start_warp_quietly()
        module = load_scene(scene)
        with meter.count(label(module), "cases") as show:
            table = command.sweep(
                module, options or (), show,
                frames=frames, tolerance=tolerance, device=device, worlds=worlds,
            )  # fmt: skip
        typer.echo(str(table))
        if table.count("failed"):
            raise typer.Exit(1)
