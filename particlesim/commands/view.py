"""The command ``particlesim view``: a page in the browser, until it is interrupted."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
import webbrowser
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from .. import validate
from ..pictures.view.footage import Footage
from ..pictures.view.live import Live
from ..pictures.view.server import Server
from .render import USD

OWNER = "view"
PORTS = 65535


def view(
    name: str,
    port: int,
    browser: bool,
    color: str | None,
    simulate: Callable[[], tuple[Any, int]],
    say: Callable[[str], None],
) -> None:
    """Show a file or a scene until interrupted.

    Args:
        name: A USD file, or a scene.
        port: Of the server; 0: any that is free.
        browser: Open a browser, where there is a display for one.
        color: Name of a value to colour by, or None.
        simulate: Makes the simulation, where ``name`` is a scene, and says how many frames to run.
        say: Takes lines for the terminal.
    """
    if validate.whole(OWNER, "port", port) > PORTS:
        raise validate.fail(OWNER, "port", f"be at most {PORTS}", port, "choose a smaller one")
    with contextlib.ExitStack() as stack:
        stack.enter_context(_stopped_by_terminate())
        stack.enter_context(contextlib.suppress(KeyboardInterrupt))
        source = _source(name, color, simulate)
        if isinstance(source, Live):
            stack.callback(source.close)
        server = stack.enter_context(Server(source, port, color))
        say(f"{name} is shown at {server.url} until you press Ctrl+C")
        if browser and _has_display():
            webbrowser.open(server.url)
        threading.Event().wait()


def _source(
    name: str, color: str | None, simulate: Callable[[], tuple[Any, int]]
) -> Footage | Live:
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


@contextlib.contextmanager
def _stopped_by_terminate() -> Iterator[None]:
    """Let SIGTERM end what is below as Ctrl+C does, so that nothing is left behind."""

    def interrupt(*_: Any) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
