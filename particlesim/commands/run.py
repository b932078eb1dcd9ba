"""The commands list, run, explain and plot."""

from __future__ import annotations

import ast
import contextlib
import math
import shlex
from pathlib import Path
from typing import Annotated, Any

import typer

from ..output import files
from ..output.interrupts import Deferred
from ..output.progress import announced, label
from .scene_files import ready_scenes
from .shell import (
    USD,
    Debug,
    Device,
    Frames,
    Options,
    Overwrite,
    Precision,
    SceneName,
    Substeps,
    Worlds,
    load,
    opened,
    simulation,
    start_warp,
    wanted_frames,
)

Out = Annotated[
    Path | None,
    typer.Option(help="File to write: .usda, .usd, .usdc, .npz, .ply, .gsd or .vtkhdf."),
]
Fields = Annotated[
    list[str] | None,
    typer.Option("--field", metavar="NAME", help="Write this array too, as density; repeat."),
]
Every = Annotated[int, typer.Option(min=1, help="Write each so many-th frame only.")]
Groups = Annotated[
    list[str] | None,
    typer.Option("--group", metavar="NAME", help="Write this group only; repeat. USD."),
]
Layout = Annotated[
    str | None, typer.Option(metavar="grid|X,Y,Z", help="Put worlds side by side. USD.")
]
ColorBy = Annotated[
    str | None, typer.Option(metavar="NAME", help="Colour by this value, as speed. USD.")
]
Surface = Annotated[bool, typer.Option("--surface", help="Write fluids as their surface. USD.")]
Instancer = Annotated[
    bool, typer.Option("--instancer", help="Write particles as instanced spheres. USD.")
]
HistoryFile = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Write energies, momenta and errors, .csv or .jsonl."),
]
CheckpointEvery = Annotated[
    int | None,
    typer.Option(
        min=0,
        metavar="FRAMES",
        help="Frames between checkpoints, 0 for none. Default: by the clock, below 2 % of it.",
    ),
]
Resume = Annotated[
    bool, typer.Option("--resume", help="Go on with the run that wrote --out, from its checkpoint.")
]
Ledger = Annotated[
    bool, typer.Option("--ledger", help="Print the work and impulse of every part at the end.")
]
Profile = Annotated[
    bool,
    typer.Option("--profile", help="Print what each pass took at the end; runs launch by launch."),
]


def list_scenes(debug: Debug = False) -> None:
    """List the ready scenes, and whether their answer is known."""
    with opened(debug):
        scenes = ready_scenes()
        width = max(map(len, scenes), default=0)
        for name, path in scenes.items():
            # Read, not imported: that takes no Warp, and costs nothing for many scenes.
            tree = ast.parse(path.read_text(encoding="utf-8"))
            functions = [node.name for node in tree.body if isinstance(node, ast.FunctionDef)]
            summary = (ast.get_docstring(tree) or "").partition("\n")[0]
            known = "  (known answer)" if "error" in functions else ""
            typer.echo(f"{name:<{width}}  {summary}{known}".rstrip())


def run(
    scene: SceneName,
    frames: Frames = None,
    out: Out = None,
    options: Options = None,
    device: Device = None,
    worlds: Worlds = None,
    precision: Precision = None,
    substeps: Substeps = None,
    fields: Fields = None,
    every: Every = 1,
    groups: Groups = None,
    layout: Layout = None,
    color_by: ColorBy = None,
    surface: Surface = False,
    instancer: Instancer = False,
    history: HistoryFile = None,
    checkpoint_every: CheckpointEvery = None,
    resume: Resume = False,
    ledger: Ledger = False,
    profile: Profile = False,
    overwrite: Overwrite = False,
    debug: Debug = False,
) -> None:
    """Run a scene, and write its frames into a file.

    Give the same words and --resume to go on with a run that was ended.
    """
    with opened(debug) as meter:
        _check_output(out, overwrite, resume)
        with announced(f"{scene}: loading"):
            start_warp(debug)
            _check_places(out, history, overwrite or resume)
        module = load(scene, debug)
        sim = simulation(
            module, options, device, worlds, precision=precision, substeps=substeps, ledger=ledger
        )
        wanted = wanted_frames(module, frames)
        drawing = _given(
            every=every, groups=groups, layout=_steps(layout), color_by=color_by, surface=surface,
            instancer=instancer,
        )  # fmt: skip
        profiling = sim.profiling() if profile else contextlib.nullcontext()
        with meter.measure(label(module), sim, wanted) as progress, profiling as profiled:
            sim.run(
                frames=wanted, record=None if out is None else str(out), progress=progress,
                overwrite=overwrite, fields=fields or (), history=history,
                checkpoint=checkpoint_every, resume=resume, **drawing,
            )  # fmt: skip
        if resume and not meter.done:
            typer.echo(f"{label(module)}: all {wanted} frames are in {out}, nothing was left to do")
            return
        known = hasattr(module, "error") and frames is None and worlds is None
        error = module.error(sim) if known else math.nan  # nan: nothing is known of this moment
        told = [meter.summary(), *([] if math.isnan(error) else [f"error {error:.3g}"])]
        typer.echo("; ".join([*told, *([] if out is None else [f"written to {out}"])]))
        for report in ([sim.ledger()] if ledger else []) + ([profiled] if profile else []):
            typer.echo(f"\n{report}")
        _suggest(out)


def _suggest(out: Path | None) -> None:
    """Say what to do with a recording, to a person."""
    from rich.console import Console

    if out is None or out.suffix.lower() not in USD or not Console().is_terminal:
        return
    file, film = shlex.quote(str(out)), shlex.quote(str(out.with_suffix(".mp4")))
    typer.echo(f"  film it:     particlesim render {file} --out {film}")
    typer.echo(f"  look at it:  particlesim view {file}")


def _given(**options: Any) -> dict[str, Any]:
    """The options that were given: not None, False, empty or the one that says all."""
    return {
        name: value
        for name, value in options.items()
        if value is True or value not in (None, False, 1, [])
    }


def explain(
    scene: SceneName,
    options: Options = None,
    device: Device = None,
    worlds: Worlds = None,
    precision: Precision = None,
    substeps: Substeps = None,
    debug: Debug = False,
) -> None:
    """Show what a scene requires.

    Arrays, kernels, launches a substep, and bytes a particle.
    """
    with opened(debug):
        sim = simulation(
            load(scene, debug), options, device, worlds, precision=precision, substeps=substeps
        )
        typer.echo(str(sim.explain()))


def plot(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="What run --history wrote.")],
    out: Annotated[
        Path | None, typer.Option(help="Picture, .png, .svg or .pdf. Default: beside the file.")
    ] = None,
    what: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,...",
            help="energy, drift, momentum, angular_momentum, potential, temperature, pressure, "
            "density, residual, observed. "
            "Default: all there are.",
        ),
    ] = None,
    overwrite: Overwrite = False,
    debug: Debug = False,
) -> None:
    """Draw what a run recorded over time."""
    with opened(debug):
        from ..output.history.plots import plot_history

        picture = file.with_suffix(".png") if out is None else out
        # Beside the file there may be a picture of something else.
        files.check_new("plot", picture, overwrite, argument="--out", consent="give --overwrite")
        names = [word.strip() for word in what.split(",")] if what else None
        drawn = plot_history(file, picture, names, overwrite=overwrite)
        typer.echo(f"{', '.join(drawn)} of {file} drawn in {picture}")


def _steps(layout: str | None) -> Any:
    """``grid``, or the step from one world to the next along each axis."""
    if layout is None or layout == "grid":
        return layout
    words = layout.split(",")
    try:
        steps = tuple(float(word) for word in words)
    except ValueError:
        steps = ()
    if len(steps) != 3:
        raise ValueError(f"--layout must be grid or three numbers, got {layout!r}; write 2,0,0.")
    return steps


def _check_places(out: Path | None, history: Path | None, may_exist: bool) -> None:
    """Refuse, before anything is loaded, what cannot be written or somebody else is writing."""
    from ..output.files import check_new
    from ..output.history.writer import SUFFIXES
    from ..output.lock import Lock
    from ..output.recorders import recorder_class

    if out is not None:
        recorder_class(out)
    if history is not None:
        check_new("run", history, may_exist, suffixes=SUFFIXES, argument="--history")
    for option, path in (("--out", out), ("--history", history)):
        if path is not None:
            with Deferred():  # or who is ended here would leave it
                Lock("run", path, option).close()


def _check_output(out: Path | None, overwrite: bool, resume: bool) -> None:
    """Refuse an output in words of the command line, before anything is loaded."""
    if resume and (out is None or overwrite):
        wrong = "comes with --overwrite" if overwrite else "has no --out"
        raise ValueError(f"--resume must say what to go on with, got one that {wrong}; give --out.")
    if out is None or overwrite:
        return
    files = [out, out.with_suffix(".checkpoint.npz")]
    there = [str(file) for file in files if file.exists()]
    if there and not resume:
        raise ValueError(
            f"--out must be a new file, got {str(out)!r} where {there[0]!r} exists; "
            "choose another, go on with --resume, or give --overwrite."
        )
    if resume and not there:
        typer.echo(f"note: nothing to resume at {out}; starting it", err=True)
