"""The command line: list, run, explain and measure scenes (see :mod:`particlesim.scene_files`).

Exit codes: 0 done, 1 a run that failed, 2 arguments that do not fit, 130 interrupted. Whatever goes
wrong is one line on stderr. Warp and USD are imported only when a scene is, so that help is quick.
"""

from __future__ import annotations

import ast
import contextlib
import math
import os
import sys
import tempfile
import traceback
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any

import typer

from .progress import Meter, bar
from .scene_files import label, load_scene, parse_options, ready_scenes, split_options

DEFAULT_FRAMES = 240

app = typer.Typer(
    help="Particle physics on NVIDIA Warp: forces and constraints in one loop.",
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    add_completion=False,
)

SceneName = Annotated[
    str, typer.Argument(metavar="SCENE", help="A ready scene's name, or the path of a scene file.")
]
Options = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME=VALUE",
        help="Set an option of the scene's build, or a field of its settings; may be repeated.",
    ),
]
Device = Annotated[
    str | None, typer.Option(help="cpu, cuda or cuda:N. Default: CUDA if there is one, else cpu.")
]
Worlds = Annotated[
    int | None, typer.Option(min=1, help="Run this many copies of the scene at once.")
]
Precision = Annotated[str | None, typer.Option(help="float32 or float64, in every kernel.")]
Substeps = Annotated[int | None, typer.Option(min=1, help="Substeps a frame.")]
Frames = Annotated[
    int | None, typer.Option(min=1, help="Frames to run. Default: the scene's own, or 240.")
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace outputs that exist.")]
Debug = Annotated[bool, typer.Option("--debug", hidden=True, help="Show tracebacks.")]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    Args:
        arguments: Words after the program's name; None: those of the process.
    """
    try:
        code = app(args=arguments, prog_name="particlesim", standalone_mode=False)
    except typer.TyperException as error:
        _complain(error.format_message())
        return error.exit_code
    return code or 0


@app.callback(invoke_without_command=True)
def _root(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Show the version.")] = False,
) -> None:
    if version:
        from . import __version__

        typer.echo(f"particlesim {__version__}")
        raise typer.Exit
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


@app.command("list")
def list_scenes(debug: Debug = False) -> None:
    """List the ready scenes, and whether their answer is known."""
    with _one_line_errors(Meter(), debug):
        scenes = ready_scenes()
        width = max(map(len, scenes), default=0)
        for name, path in scenes.items():
            # Read, not imported: that takes no Warp, and costs nothing for many scenes.
            tree = ast.parse(path.read_text(encoding="utf-8"))
            functions = [node.name for node in tree.body if isinstance(node, ast.FunctionDef)]
            summary = (ast.get_docstring(tree) or "").partition("\n")[0]
            known = "  (known answer)" if "error" in functions else ""
            typer.echo(f"{name:<{width}}  {summary}{known}".rstrip())


@app.command()
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
    history: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write energies, momenta and errors, .csv or .jsonl."),
    ] = None,
    checkpoint_every: Annotated[
        int | None,
        typer.Option(
            min=0, metavar="FRAMES",
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
    with _one_line_errors(meter, debug):
        _check_output(out, overwrite, resume)
        if not debug:
            _start_warp_quietly()
        module = load_scene(scene)
        assignments = _assignments(options, precision, substeps)
        assignments += ["ledger=True"] if ledger else []
        sim = _simulation(module, assignments, device, worlds)
        wanted = getattr(module, "frames", DEFAULT_FRAMES) if frames is None else frames
        with meter.measure(label(module), sim, wanted) as progress:
            record = None if out is None else str(out)
            sim.run(
                frames=wanted, record=record, progress=progress, overwrite=overwrite,
                fields=fields or (), history=history, checkpoint=checkpoint_every, resume=resume,
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


@app.command()
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
    with _one_line_errors(Meter(), debug):
        if not debug:
            _start_warp_quietly()
        module = load_scene(scene)
        assignments = _assignments(options, precision, substeps)
        sim = _simulation(module, assignments, device, worlds)
        typer.echo(str(sim.explain()))


@app.command()
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
    with _one_line_errors(meter, debug):
        from .tradeoff import command

        command.check_outputs({"--plot": plot, "--save": save}, overwrite)
        if not debug:
            _start_warp_quietly()
        table = command.sweep(
            load_scene(scene), options or (), vary or (), error, reference or (), meter,
            frames=frames, repeats=repeats, bound=bound, device=device,
        )  # fmt: skip
        typer.echo(str(table))
        command.write(table, plot, save)


@app.command()
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
    with _one_line_errors(Meter(), debug):
        from .plots import plot_history

        picture = file.with_suffix(".png") if out is None else out
        names = [word.strip() for word in what.split(",")] if what else None
        drawn = plot_history(file, picture, names, overwrite=overwrite)
        typer.echo(f"{', '.join(drawn)} of {file} drawn in {picture}")


@app.command()
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
    with _one_line_errors(meter, debug):
        from .render import command

        request = command.Request(
            out, frame, frames, camera, color, color_map, color_range, width, height, ground, fps,
            engine, samples, python, device, overwrite,
        )  # fmt: skip
        if not debug:
            _start_warp_quietly()

        def simulate() -> Any:
            return _simulation(load_scene(file), options or [], device, None)

        typer.echo(command.render(file, request, meter, simulate))


@app.command()
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
    with _one_line_errors(Meter(), debug):
        from .view import command

        def simulate() -> tuple[Any, int]:
            if not debug:
                _start_warp_quietly()
            module = load_scene(file)
            assignments = _assignments(options, precision, substeps)
            sim = _simulation(module, assignments, device, worlds)
            wanted = getattr(module, "frames", DEFAULT_FRAMES) if frames is None else frames
            return sim, wanted

        command.view(file, port, browser, color, simulate, typer.echo)


usd = typer.Typer(help="Look into USD files, check them, and pack them.", rich_markup_mode=None)
app.add_typer(usd, name="usd")
UsdFile = Annotated[Path, typer.Argument(metavar="FILE", help="A recording, or any USD file.")]


@usd.command()
def info(file: UsdFile, debug: Debug = False) -> None:
    """Show what is inside: the stage, its frames, what is drawn, and bytes."""
    with _one_line_errors(Meter(), debug):
        from .usd_tools import command

        typer.echo(command.show(file))


@usd.command()
def check(file: UsdFile, debug: Debug = False) -> None:
    """Look for faults at every frame, and show one line for each.

    Exit code 1: there are some.
    """
    with _one_line_errors(Meter(), debug):
        from .usd_tools import command

        found = command.complaints(file)
        for line in found:
            typer.echo(line)
        if found:
            raise typer.Exit(1)
        typer.echo(f"{file}: no faults")


@usd.command()
def pack(
    file: UsdFile,
    out: Annotated[Path, typer.Option(help="File to write, .usdc or .usd.")],
    overwrite: Overwrite = False,
    debug: Debug = False,
) -> None:
    """Put a recording's frames into one file."""
    with _one_line_errors(Meter(), debug):
        from .usd_tools import command

        typer.echo(command.packed(file, out, overwrite))


@app.command()
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
    with _one_line_errors(meter, debug):
        from .stress import command

        if not debug:
            _start_warp_quietly()
        module = load_scene(scene)
        with bar(label(module), "cases") as show:
            table = command.sweep(
                module, options or (), show,
                frames=frames, tolerance=tolerance, device=device, worlds=worlds,
            )  # fmt: skip
        typer.echo(str(table))
        if table.count("failed"):
            raise typer.Exit(1)


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


def _assignments(
    options: list[str] | None, precision: str | None, substeps: int | None
) -> list[str]:
    """All that is to be set: ``--precision`` and ``--substeps`` are short for a ``--set``."""
    short = {"precision": precision, "substeps": substeps}
    return [*(options or []), *(f"{name}={short[name]}" for name in short if short[name])]


def _simulation(
    module: ModuleType,
    assignments: list[str],
    device: str | None,
    worlds: int | None,
) -> Any:
    """The scene with its options and settings, on a device."""
    import particlesim

    options, knobs = split_options(module, parse_options(assignments))
    settings = module.settings.replace(**knobs)
    scene = module.build(**options)
    return particlesim.Simulation(scene, settings, device=device, worlds=worlds)


def _start_warp_quietly() -> None:
    """Start Warp, without a line for each module it loads and one for CUDA that is not there.

    The latter is printed by its C code past every log level, so it is taken out of the stream.
    """
    import warp

    warp.config.log_level = warp.LOG_WARNING
    stream = os.dup(2)
    with tempfile.TemporaryFile() as printed:
        os.dup2(printed.fileno(), 2)
        try:
            warp.init()
        finally:
            os.dup2(stream, 2)
            os.close(stream)
        printed.seek(0)
        for line in printed.read().decode(errors="replace").splitlines():
            if "Could not find or load the NVIDIA CUDA driver" not in line:
                typer.echo(line, err=True)


@contextlib.contextmanager
def _one_line_errors(meter: Meter, debug: bool) -> Iterator[None]:
    """Turn whatever goes wrong into one line and an exit code.

    Before the first frame is done it is the arguments (2), unless the engine says that it failed:
    a RuntimeError or no memory (1). After that it is the run (1).
    """
    try:
        yield
    except (typer.Exit, typer.TyperException):
        raise
    except BrokenPipeError:
        # Who reads has what they wanted, as head does. Nothing may be left to flush at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise typer.Exit(0) from None
    except KeyboardInterrupt:
        _complain(f"interrupted after {meter.done} of {meter.frames} frames")
        raise typer.Exit(130) from None
    except Exception as error:
        if debug:
            traceback.print_exc()
        _complain(_describe(error))
        failed = meter.done > 0 or isinstance(error, RuntimeError | MemoryError)
        raise typer.Exit(1 if failed else 2) from None


def _describe(error: Exception) -> str:
    if isinstance(error, OSError) and error.filename and error.strerror:
        return f"{error.filename}: {error.strerror}"
    if isinstance(error, ValueError | OSError | RuntimeError) and str(error):
        return str(error)
    if isinstance(error, ImportError) and error.name is None:  # an extra that is not installed
        return str(error)
    # Not written to be read alone: say what it is, and where the scene, or else the engine, was.
    text = f"{type(error).__name__}: {error}"
    if not isinstance(error, SyntaxError):
        places = traceback.extract_tb(error.__traceback__)
        outside = [p for p in places if not p.filename.startswith(os.path.dirname(__file__))]
        place = (outside or places)[-1]
        text += f" ({os.path.basename(place.filename)}, line {place.lineno})"
    return f"{text}; --debug shows the traceback"


def _complain(message: str) -> None:
    typer.echo(f"error: {' '.join(message.split())}", err=True)


if __name__ == "__main__":
    sys.exit(main())
