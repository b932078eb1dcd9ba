"""The command measure: a number with its error."""

from __future__ import annotations

from types import ModuleType
from typing import Annotated, Any

import typer

from .scene_files import load_function, parse_options, split_options
from .shell import Debug, Device, Frames, Options, SceneName, load, opened


def measure(
    scene: SceneName,
    observe: Annotated[
        str,
        typer.Option(
            help="energy, kinetic, potential, momentum, angular_momentum, virial, temperature, "
            "pressure, stress, a function of the scene's module, MODULE:FUNCTION or "
            "FILE.py:FUNCTION."
        ),
    ],
    error: Annotated[float, typer.Option(help="Half the width of the interval, at most.")] = 1e-3,
    confidence: Annotated[float, typer.Option(help="Of the interval.")] = 0.95,
    over: Annotated[str, typer.Option(help="final, mean, max, rms or period.")] = "final",
    space: Annotated[
        str, typer.Option(help="Option of build to refine; none: none. Default: as it is found.")
    ] = "auto",
    options: Options = None,
    frames: Frames = None,
    budget: Annotated[float | None, typer.Option(help="Seconds that it may take.")] = None,
    device: Device = None,
    debug: Debug = False,
) -> None:
    """Measure a number of a scene, with its error and what that is made of."""
    with opened(debug) as meter:
        module = load(scene, debug)
        from ..accuracy.measure.measuring import measure as find

        build, knobs = split_options(module, parse_options(options or ()))
        meter.unit = "runs"

        def show(line: str) -> None:
            meter.done = meter.frames = meter.done + 1
            typer.echo(line, err=True)

        found = find(
            module.build, _observable(module, observe), error, confidence, over=over,
            space=None if space == "none" else space, settings=module.settings.replace(**knobs),
            frames=frames, options=build, device=device, budget=budget, progress=show,
        )  # fmt: skip
        typer.echo(str(found))


def _observable(module: ModuleType, text: str) -> Any:
    """What is named: a ready one, a function of the scene's module, or one of another."""
    if ":" in text:
        return load_function(text, "--observe")
    own = getattr(module, text, None)
    return own if callable(own) else text
