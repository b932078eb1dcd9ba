"""The commands tradeoff, tune and stress."""

from __future__ import annotations

import contextlib
import inspect
import warnings
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any

import typer

from .. import validate
from ..output.progress import label
from .scene_files import parse_options, parse_vary, split_options
from .shell import Debug, Device, Frames, Options, Overwrite, SceneName, Worlds, load, opened

Vary = Annotated[
    list[str] | None,
    typer.Option(metavar="NAME=VALUE,...", help="Values of a setting or option; repeat."),
]
ErrorName = Annotated[
    str | None,
    typer.Option(help="known, converged, energy or momentum. Default: known if it is."),
]
Observe = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help="Compare this with a reference: position, velocity, energy, kinetic, potential, "
        "momentum, angular_momentum, virial, temperature, pressure, stress, or a function of the "
        "scene.",
    ),
]
Over = Annotated[
    str | None,
    typer.Option(help="Error over time: final, max, rms, or mean, of the average."),
]


def tradeoff(
    scene: SceneName,
    vary: Vary = None,
    options: Options = None,
    frames: Frames = None,
    repeats: Annotated[int, typer.Option(min=1, help="Timed runs of each setting.")] = 3,
    error: ErrorName = None,
    observe: Observe = None,
    over: Over = None,
    seeds: Annotated[int, typer.Option(min=1, help="Seeds whose median error counts.")] = 1,
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
    with opened(debug) as meter:
        _check_outputs(plot, save, overwrite)
        module = load(scene, debug)
        from ..accuracy.judging import ERRORS
        from ..accuracy.tradeoff.sweep import tradeoff as sweep

        if error is not None:
            validate.choice("tradeoff", "--error", error, ERRORS)
        seen = _observed("tradeoff", module, observe, over)
        varied = parse_vary(vary or ())
        if not varied:
            raise ValueError(
                "--vary must be given, got nothing; write --vary substeps=1,2,5, and repeat it "
                "for further knobs."
            )
        fixed = parse_options(options or ())
        # An option that build needs is set by being varied.
        needed = [name for name in inspect.signature(module.build).parameters if name in varied]
        build, knobs = split_options(module, {**{n: varied[n][0] for n in needed}, **fixed})
        with _one_line_warnings(), meter.count(label(module), at_last="reference") as progress:
            table = sweep(
                module.build, varied, error=error, observe=seen, over=over,
                reference=parse_options(reference or ()) or None, seeds=seeds, repeats=repeats,
                frames=frames, settings=module.settings.replace(**knobs),
                options={name: value for name, value in build.items() if name in fixed},
                bound=bound, device=device, progress=progress,
            )  # fmt: skip
        typer.echo(str(table))
        # That these may be replaced has been checked.
        if save is not None:
            table.save(save, overwrite=True)
        if plot is not None:
            table.plot(plot, overwrite=True)


def tune(
    scene: SceneName,
    error: Annotated[float, typer.Option(help="The error to stay under.")] = 1e-3,
    budget: Annotated[
        str | None,
        typer.Option(metavar="TIME", help="Instead: the least error in this time, as '60 s'."),
    ] = None,
    by: ErrorName = None,
    observe: Observe = None,
    over: Over = None,
    vary: Vary = None,
    options: Options = None,
    frames: Frames = None,
    seeds: Annotated[int, typer.Option(min=1, help="Seeds to try everything with.")] = 3,
    device: Device = None,
    debug: Debug = False,
) -> None:
    """Find the cheapest settings under an error, or the best in a time; print them as Python."""
    with opened(debug) as meter:
        module = load(scene, debug)
        from ..accuracy.judging import ERRORS
        from ..accuracy.tune.tuning import tune as search

        if by is not None:
            validate.choice("tune", "--by", by, ERRORS)
        seen = _observed("tune", module, observe, over)
        build, knobs = split_options(module, parse_options(options or ()))
        meter.unit = "settings"

        def show(trial: Any) -> None:
            meter.done = meter.frames = meter.done + 1
            typer.echo(str(trial), err=True)

        with _one_line_warnings():
            found = search(
                module.build, error, budget=budget, by=by, observe=seen, over=over,
                vary=parse_vary(vary or ()), seeds=seeds, frames=frames, options=build,
                settings=module.settings.replace(**knobs), device=device, progress=show,
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
    with opened(debug) as meter:
        module = load(scene, debug)
        from ..accuracy.stress.sweep import stress as sweep

        build, knobs = split_options(module, parse_options(options or ()))
        with meter.count(label(module), "cases") as progress:
            table = sweep(
                lambda: module.build(**build), module.settings.replace(**knobs), frames=frames,
                tolerance=tolerance, device=device, worlds=worlds, progress=progress,
            )  # fmt: skip
        typer.echo(str(table))
        if table.count("failed"):
            raise typer.Exit(1)


def _observed(owner: str, module: ModuleType, name: str | None, over: str | None) -> Any:
    """What --observe names: of the module, if it has such a function, or ready."""
    from ..accuracy.observables import READY
    from ..accuracy.series import OVER

    if over is not None:
        validate.choice(owner, "--over", over, OVER)
    if name is None:
        return None
    own = [each for each, value in vars(module).items() if _observes(module, each, value)]
    validate.choice(owner, "--observe", name, [*own, *READY])
    return getattr(module, name) if name in own else name


def _observes(module: ModuleType, name: str, value: Any) -> bool:
    """Whether it is a function of the module's own that users may mean."""
    own = getattr(value, "__module__", None) == module.__name__
    return inspect.isfunction(value) and own and not name.startswith("_") and name != "build"


def _check_outputs(picture: Path | None, table: Path | None, overwrite: bool) -> None:
    """Find out before a long sweep what would stop it from being written."""
    from ..accuracy.tradeoff import output, plot
    from ..output.files import check_new

    consent = "give --overwrite"
    if table is not None:
        check_new(
            "tradeoff",
            table,
            overwrite,
            suffixes=output.FORMATS,
            argument="--save",
            consent=consent,
        )
    if picture is not None:
        check_new(
            "tradeoff",
            picture,
            overwrite,
            suffixes=plot.FORMATS,
            argument="--plot",
            consent=consent,
        )
        plot.figure_class()


@contextlib.contextmanager
def _one_line_warnings() -> Iterator[None]:
    """Print what is warned of when all is done, a line each."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield
    for warning in caught:
        typer.echo(f"warning: {' '.join(str(warning.message).split())}", err=True)
