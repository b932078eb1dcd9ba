"""The command line: list, run and explain scenes.

A scene is a module that defines ``build(**options) -> Scene``, ``settings`` and, if its answer is
known, ``error(sim) -> float``; ``frames``, if it is there, is how many frames it wants. It is named
by the name of a ready scene or by the path of a file.

Exit codes: 0 done, 1 a run that failed, 2 arguments that do not fit, 130 interrupted. Whatever goes
wrong is one line on stderr. Warp and USD are imported only when a scene is, so that help is quick.
"""

from __future__ import annotations

import ast
import contextlib
import dataclasses
import importlib.util
import inspect
import os
import pkgutil
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any

import typer

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
    with _one_line_errors(_Meter(), debug):
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
    frames: Annotated[
        int | None, typer.Option(min=1, help="Frames to run. Default: the scene's own, or 240.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="USD file to write, .usda.")] = None,
    options: Options = None,
    device: Device = None,
    worlds: Worlds = None,
    precision: Precision = None,
    substeps: Substeps = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace an output that exists.")
    ] = False,
    debug: Debug = False,
) -> None:
    """Run a scene, and write its frames into a USD file."""
    meter = _Meter()
    with _one_line_errors(meter, debug):
        if out is not None and out.exists() and not overwrite:
            raise ValueError(
                f"--out must be a new file, got {str(out)!r}, which exists; "
                "choose another or give --overwrite."
            )
        if not debug:
            _start_warp_quietly()
        module = load_scene(scene)
        assignments = _assignments(options, precision, substeps)
        sim = _simulation(module, assignments, device, worlds)
        wanted = getattr(module, "frames", DEFAULT_FRAMES) if frames is None else frames
        with meter.measure(_label(module), sim, wanted) as progress:
            record = None if out is None else str(out)
            sim.run(frames=wanted, record=record, progress=progress, overwrite=overwrite)
        summary = meter.summary()
        if hasattr(module, "error") and frames is None and worlds is None:
            summary += f"; error {module.error(sim):.3g}"
        typer.echo(summary if out is None else f"{summary}; written to {out}")


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
    with _one_line_errors(_Meter(), debug):
        if not debug:
            _start_warp_quietly()
        module = load_scene(scene)
        assignments = _assignments(options, precision, substeps)
        sim = _simulation(module, assignments, device, worlds)
        typer.echo(str(sim.explain()))


def ready_scenes() -> dict[str, Path]:
    """Names of the ready scenes, in order, and their files."""
    package = importlib.import_module("particlesim.scenes")
    names = sorted(
        module.name
        for module in pkgutil.iter_modules(package.__path__)
        if not module.ispkg and not module.name.startswith("_")
    )
    return {name: Path(package.__path__[0]) / f"{name}.py" for name in names}


def load_scene(name: str) -> ModuleType:
    """The module of a ready scene or of a scene file.

    Args:
        name: A ready scene's name, or a path: ends in ``.py`` or has a folder in it.

    Raises:
        ValueError: No such scene, or a module without ``build`` and ``settings``.
    """
    import particlesim

    if name.endswith(".py") or os.path.basename(name) != name:
        module = _load_file(Path(name))
    elif name in ready_scenes():
        module = importlib.import_module(f"particlesim.scenes.{name}")
    else:
        raise ValueError(
            f"SCENE must be a ready scene or the path of a .py file, got {name!r}; "
            f"the ready scenes are {', '.join(ready_scenes())}."
        )
    if not callable(getattr(module, "build", None)):
        raise ValueError(f"{name}: build must be a function that returns a Scene; define it.")
    if not isinstance(getattr(module, "settings", None), particlesim.Settings):
        raise ValueError(f"{name}: settings must be a particlesim.Settings; define it.")
    return module


def _load_file(path: Path) -> ModuleType:
    if not path.is_file():
        raise ValueError(f"SCENE must be a file that exists, got {str(path)!r}; check the path.")
    specification = importlib.util.spec_from_file_location(f"scene_{path.stem}", path)
    if specification is None or specification.loader is None:
        raise ValueError(f"SCENE must be a Python file, got {str(path)!r}; name it .py.")
    module = importlib.util.module_from_spec(specification)
    # Laws and dataclasses look their module up by name, and a scene may import its neighbours.
    sys.modules[specification.name] = module
    sys.path.append(str(path.parent.resolve()))
    specification.loader.exec_module(module)
    return module


def _label(module: ModuleType) -> str:
    return module.__name__.rpartition(".")[2].removeprefix("scene_")


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


def parse_options(assignments: Sequence[str]) -> dict[str, Any]:
    """``["name=value", ...]`` as a dict.

    A value is a Python literal, ``true``, ``false`` or a fraction like ``1/60``, else a string.

    Raises:
        ValueError: No ``=``, no name, or a name given twice.
    """
    options: dict[str, Any] = {}
    for assignment in assignments:
        name, equals, text = assignment.partition("=")
        name = name.strip().replace("-", "_")
        if not equals or not name.isidentifier():
            raise ValueError(f"--set must be NAME=VALUE, got {assignment!r}; write --set name=1.")
        if name in options:
            raise ValueError(f"--set must name an option once, got {name!r} twice; drop one.")
        options[name] = _parse_value(text.strip())
    return options


def _parse_value(text: str) -> Any:
    # As text, "false" would count as true in a condition.
    if text in ("true", "false"):
        return text == "true"
    with contextlib.suppress(ValueError, SyntaxError, MemoryError, RecursionError):
        return ast.literal_eval(text)
    with contextlib.suppress(ValueError, ZeroDivisionError):
        return float(Fraction(text))
    return text


def split_options(
    module: ModuleType, options: dict[str, Any]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Divide options into those of the scene's ``build`` and those that are knobs of its settings.

    A name that is both goes to ``build``.

    Raises:
        ValueError: A name that is neither, text where ``build`` has a number, or an option that
            ``build`` needs and nobody set.
    """
    from . import validate

    parameters = inspect.signature(module.build).parameters
    kinds = {parameter.kind for parameter in parameters.values()}
    named = {
        name: parameter
        for name, parameter in parameters.items()
        if parameter.kind in (parameter.POSITIONAL_OR_KEYWORD, parameter.KEYWORD_ONLY)
    }
    known_knobs = [field.name for field in dataclasses.fields(module.settings)]
    build_options: dict[str, Any] = {}
    knobs: dict[str, Any] = {}
    for name, value in options.items():
        if name in named:
            _check_kind(name, value, named[name].default)
            build_options[name] = value
        elif name in known_knobs:
            knobs[name] = value
        elif inspect.Parameter.VAR_KEYWORD in kinds:
            build_options[name] = value
        else:
            raise ValueError(
                f"--set must name an option of {_label(module)} ({', '.join(named) or 'none'}) "
                f"or a setting ({', '.join(known_knobs)}), got {name!r}; "
                f"{validate.suggest(name, [*named, *known_knobs])}."
            )
    for name, parameter in named.items():
        if parameter.default is parameter.empty and name not in build_options:
            raise ValueError(f"{_label(module)}: {name} must be set; give --set {name}=VALUE.")
    return build_options, knobs


def _check_kind(name: str, value: Any, default: Any) -> None:
    """Refuse text for an option that is a number by default, before it fails somewhere inside."""
    if isinstance(default, int | float) and not isinstance(value, int | float):
        kind = "true or false" if isinstance(default, bool) else "a number"
        raise ValueError(f"--set {name} must be {kind}, got {value!r}; its default is {default!r}.")


class _Meter:
    """Progress of a run: a bar on a terminal, the rate, and a summary."""

    def __init__(self) -> None:
        self.done = 0
        self.label, self.frames, self.particles, self.work = "", 0, 0, 0
        self.started = self.first = self.last = 0.0

    @contextlib.contextmanager
    def measure(self, label: str, sim: Any, frames: int) -> Iterator[Callable[[int, int], None]]:
        """Show a bar while the simulation runs; yields what it calls after every frame."""
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            Progress,
            TextColumn,
            TimeRemainingColumn,
        )

        self.label, self.frames, self.particles = label, frames, sim.particle_count
        self.work = self.particles * sim.settings.substeps
        columns = [
            TextColumn("{task.description}", markup=False),
            BarColumn(), MofNCompleteColumn(), TextColumn("frames"),
            TextColumn("{task.fields[detail]}", markup=False), TimeRemainingColumn(),
        ]  # fmt: skip
        console = Console(stderr=True)
        self.started = time.perf_counter()
        with Progress(*columns, console=console, disable=not console.is_terminal) as bar:
            count = f"{self.particles:,} particles"
            task = bar.add_task(f"{label}: compiling", total=frames, detail=count)

            def after_frame(frame: int, frames: int) -> None:
                self.done += 1
                self.last = time.perf_counter()
                self.first = self.first or self.last
                detail = f"{count}, {self.rate()}"
                bar.update(task, completed=self.done, description=label, detail=detail)

            yield after_frame

    def rate(self) -> str:
        """Particle-substeps a second; without the first frame, if there are others: it compiles."""
        frames, since = (self.done - 1, self.first) if self.done > 1 else (1, self.started)
        rate = frames * self.work / max(self.last - since, 1e-9)
        for limit, prefix in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
            if rate >= limit:
                return f"{rate / limit:.3g} {prefix} particle-substeps/s"
        return f"{rate:.3g} particle-substeps/s"

    def summary(self) -> str:
        """What was done, and how fast."""
        seconds = time.perf_counter() - self.started
        return (
            f"{self.label}: {self.frames} frames of {self.particles:,} particles in "
            f"{seconds:.3g} s, {self.rate()}"
        )


@contextlib.contextmanager
def _one_line_errors(meter: _Meter, debug: bool) -> Iterator[None]:
    """Turn whatever goes wrong into one line and an exit code.

    Before the first frame is done it is the arguments (2), unless the engine says that it failed:
    a RuntimeError or no memory (1). After that it is the run (1).
    """
    try:
        yield
    except (typer.Exit, typer.TyperException):
        raise
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
