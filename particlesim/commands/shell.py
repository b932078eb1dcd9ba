"""What commands share: their words, their opening, and one line for whatever goes wrong."""

from __future__ import annotations

import contextlib
import os
import sys
import traceback
from collections.abc import Iterator
from types import ModuleType
from typing import Annotated, Any

import typer

from ..output.interrupts import Terminated, terminable
from ..output.progress import Meter, announced, label
from .scene_files import load_scene, parse_options, split_options

DEFAULT_FRAMES = 240
PACKAGE = os.path.dirname(os.path.dirname(__file__))
USD = (".usda", ".usd", ".usdc", ".usdz")

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
Color = Annotated[
    str | None, typer.Option(metavar="NAME", help="Colour by this value, as density or speed.")
]


@contextlib.contextmanager
def opened(debug: bool) -> Iterator[Meter]:
    """Turn whatever goes wrong into one line and an exit code; yields what counts what is done.

    Before the first frame is done it is the arguments (2), unless the engine says that it failed:
    a RuntimeError or no memory (1). After that it is the run (1).
    """
    meter = Meter()
    try:
        with terminable():
            yield meter
    except (typer.Exit, typer.TyperException):
        raise
    except BrokenPipeError:
        # Who reads has what they wanted, as head does. Nothing may be left to flush at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise typer.Exit(0) from None
    except (KeyboardInterrupt, Terminated) as error:
        word, code = ("terminated", 143) if isinstance(error, Terminated) else ("interrupted", 130)
        complain(f"{word} after {meter.done} of {meter.frames} {meter.unit}")
        raise typer.Exit(code) from None
    except Exception as error:
        if debug:
            traceback.print_exc()
        complain(describe(error))
        failed = meter.done > 0 or isinstance(error, RuntimeError | MemoryError)
        raise typer.Exit(1 if failed else 2) from None


def load(name: str, debug: bool) -> ModuleType:
    """The module of a scene; Warp is started for it."""
    with announced(f"{name}: loading"):
        start_warp(debug)
        return load_scene(name)


def start_warp(debug: bool) -> None:
    """Start Warp quietly; where it cannot keep its kernels, the error says what to set."""
    from ..engine.start import start_warp as start

    try:
        start(debug)
    except OSError as error:
        raise OSError(_no_cache(error)) from error


def simulation(
    module: ModuleType,
    options: list[str] | None,
    device: str | None,
    worlds: int | None,
    **short: Any,
) -> Any:
    """The scene with its options and settings, on a device.

    ``short``: knobs with an option of their own, which is short for a ``--set``.
    """
    from ..simulation.simulation import Simulation

    assignments = [f"{name}={value}" for name, value in short.items() if value]
    chosen, knobs = split_options(module, parse_options([*(options or []), *assignments]))
    settings = module.settings.replace(**knobs)
    with announced(f"{label(module)}: building"):
        scene = module.build(**chosen)
    count = getattr(scene, "particle_count", 0) * (worlds or 1)
    with announced(f"{label(module)}: preparing {count:,} particles"):
        return Simulation(scene, settings, device=device, worlds=worlds)


def wanted_frames(module: ModuleType, frames: int | None) -> int:
    """How many frames to run: as asked for, or the scene's own."""
    return getattr(module, "frames", DEFAULT_FRAMES) if frames is None else frames


def _no_cache(error: OSError) -> str:
    """What to do where Warp cannot keep its kernels."""
    return (
        f"Warp: kernel cache must be in a folder that can be written, got {error}; set "
        "WARP_CACHE_PATH to another."
    )


def _in_cache(path: str) -> bool:
    """Whether a file is one of Warp's; asks Warp only if it has been started."""
    warp = sys.modules.get("warp")
    folder = None if warp is None else warp.config.kernel_cache_dir
    return folder is not None and os.path.abspath(path).startswith(os.path.abspath(folder) + os.sep)


def describe(error: Exception) -> str:
    if isinstance(error, OSError) and _in_cache(str(error.filename)):
        return _no_cache(error)
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
        outside = [p for p in places if not p.filename.startswith(PACKAGE)]
        place = (outside or places)[-1]
        text += f" ({os.path.basename(place.filename)}, line {place.lineno})"
    return f"{text}; --debug shows the traceback"


def complain(message: str) -> None:
    typer.echo(f"error: {' '.join(message.split())}", err=True)
