"""The commands list, run and explain."""

from __future__ import annotations

import ast
import math
from pathlib import Path
from typing import Annotated, Any

import typer

from ..output.progress import Meter
from .scene_files import label, load_scene, ready_scenes
from .shell import (
    DEFAULT_FRAMES,
    Debug,
    Device,
    Frames,
    Options,
    Overwrite,
    Precision,
    SceneName,
    Substeps,
    Worlds,
    assigned,
    given,
    one_line_errors,
    simulation,
    start_warp_quietly,
)


def list_scenes(debug: Debug = False) -> None:
    """List the ready scenes, and whether their answer is known."""
    with one_line_errors(Meter(), debug):
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
    out: Annotated[
        Path | None,
        typer.Option(help="File to write: .usda, .usd, .usdc, .npz, .ply, .gsd or .vtkhdf."),
    ] = None,
    options: Options = None,
    device: Device = None,
    worlds: Worlds = None,
    precision: Precision = None,
    substeps: Substeps = None,
    fields: Annotated[
        list[str] | None,
        typer.Option("--field", metavar="NAME", help="Write this array too, as density; repeat."),
    ] = None,
    every: Annotated[int, typer.Option(min=1, help="Write each so many-th frame only.")] = 1,
    groups: Annotated[
        list[str] | None,
        typer.Option("--group", metavar="NAME", help="Write this group only; repeat. USD."),
    ] = None,
    layout: Annotated[
        str | None, typer.Option(metavar="grid|X,Y,Z", help="Put worlds side by side. USD.")
    ] = None,
    color_by: Annotated[
        str | None, typer.Option(metavar="NAME", help="Colour by this value, as speed. USD.")
    ] = None,
    surface: Annotated[
        bool, typer.Option("--surface", help="Write fluids as their surface. USD.")
    ] = False,
    instancer: Annotated[
        bool, typer.Option("--instancer", help="Write particles as instanced spheres. USD.")
    ] = False,
    history: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write energies, momenta and errors, .csv or .jsonl."),
    ] = None,
    checkpoint_every: Annotated[
        int | None,
        typer.Option(
            min=0,
            metavar="FRAMES",
            help="Frames between checkpoints, 0 for none. Default: by the clock, below 2 % of it.",
        ),
    ] = None,
    resume: Annotated[
        bool,
        typer.Option("--resume", help="Go on with the run that wrote --out, from its checkpoint."),
    ] = False,
    ledger: Annotated[
        bool,
        typer.Option("--ledger", help="Print the work and impulse of every part at the end."),
    ] = False,
    overwrite: Overwrite = False,
    debug: Debug = False,
) -> None:
    """Run a scene, and write its frames into a file.

    Give the same words and --resume to go on with a run that was ended.
    """
    meter = Meter()
    with one_line_errors(meter, debug):
        _check_output(out, overwrite, resume)
        if not debug:
            start_warp_quietly()
        module = load_scene(scene)
        assignments = assigned(options, precision, substeps)
        assignments += ["ledger=True"] if ledger else []
        sim = simulation(module, assignments, device, worlds)
        wanted = getattr(module, "frames", DEFAULT_FRAMES) if frames is None else frames
        drawing = given(
            every=every, groups=groups, layout=_steps(layout), color_by=color_by, surface=surface,
            instancer=instancer,
        )  # fmt: skip
        with meter.measure(label(module), sim, wanted) as progress:
            record = None if out is None else str(out)
            sim.run(
                frames=wanted, record=record, progress=progress, overwrite=overwrite,
                fields=fields or (), history=history, checkpoint=checkpoint_every, resume=resume,
                **drawing,
            )  # fmt: skip
        if resume and not meter.done:
            typer.echo(f"{label(module)}: all {wanted} frames are in {out}, nothing was left to do")
            return
        summary = meter.summary()
        if hasattr(module, "error") and frames is None and worlds is None:
            error = module.error(sim)
            if not math.isnan(error):  # nan: nothing is known of this moment
                summary += f"; error {error:.3g}"
        typer.echo(summary if out is None else f"{summary}; written to {out}")
        if ledger:
            typer.echo(str(sim.ledger()))


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
    with one_line_errors(Meter(), debug):
        if not debug:
            start_warp_quietly()
        module = load_scene(scene)
        assignments = assigned(options, precision, substeps)
        sim = simulation(module, assignments, device, worlds)
        typer.echo(str(sim.explain()))


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
