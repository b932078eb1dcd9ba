"""The command view: a page in the browser, until it is interrupted."""

from __future__ import annotations

import contextlib
import os
import sys
import threading
import webbrowser
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from .. import validate
from ..output.interrupts import Terminated, heard
from .shell import (
    USD,
    Color,
    Debug,
    Device,
    Frames,
    Options,
    Precision,
    Substeps,
    Worlds,
    load,
    opened,
    simulation,
    wanted_frames,
)

OWNER = "view"
PORTS = 65535


def view(
    file: Annotated[
        str, typer.Argument(metavar="FILE", help="A recording, any USD file, or a scene to run.")
    ],
    port: Annotated[int, typer.Option(help="Port of the page. Default: any that is free.")] = 0,
    browser: Annotated[bool, typer.Option(help="Open a browser, or only say where.")] = True,
    color: Color = None,
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
    with opened(debug):

        def simulate() -> tuple[Any, int]:
            module = load(file, debug)
            sim = simulation(
                module, options, device, worlds, precision=precision, substeps=substeps
            )
            return sim, wanted_frames(module, frames)

        _show(file, port, browser, color, simulate)


def _show(
    name: str, port: int, browser: bool, color: str | None, simulate: Callable[[], tuple[Any, int]]
) -> None:
    """Show a file or a scene until interrupted.

    Args:
        name: A USD file, or a scene.
        port: Of the server; 0: any that is free.
        browser: Open a browser, where there is a display for one.
        color: Name of a value to colour by, or None.
        simulate: Makes the simulation, where ``name`` is a scene, and says how many frames to run.
    """
    from ..pictures.view.live import Live
    from ..pictures.view.server import Server

    if validate.whole(OWNER, "port", port) > PORTS:
        raise validate.fail(OWNER, "port", f"be at most {PORTS}", port, "choose a smaller one")
    with contextlib.ExitStack() as stack:
        stack.callback(heard)
        stack.enter_context(contextlib.suppress(KeyboardInterrupt, Terminated))
        source = _source(name, color, simulate)
        if isinstance(source, Live):
            stack.callback(source.close)
        server = stack.enter_context(Server(source, port, color))
        typer.echo(f"{name} is shown at {server.url} until you press Ctrl+C")
        if browser and _has_display():
            webbrowser.open(server.url)
        threading.Event().wait()


def _source(name: str, color: str | None, simulate: Callable[[], tuple[Any, int]]) -> Any:
    """What is shown: a recording, or a simulation that runs."""
    from ..pictures.view.footage import Footage
    from ..pictures.view.live import Live

    if Path(name).suffix.lower() in USD:
        footage = Footage(Path(name))
        if color is not None:
            footage.check_field(color)
        return footage
    sim, frames = simulate()
    return Live(sim, frames, fields_of(sim, color), Path(name).stem)


def fields_of(sim: Any, color: str | None) -> list[str]:
    """What to record besides speed, which every recording has: densities, and what is asked for."""
    from ..output.fields import readable

    wanted = ["density", *([color] if color not in (None, "speed") else [])]
    return [name for name in dict.fromkeys(wanted) if name in readable(sim) or name == color]


def _has_display() -> bool:
    """Whether a browser would have a window: without one it would take over the terminal."""
    if sys.platform in ("win32", "darwin"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
