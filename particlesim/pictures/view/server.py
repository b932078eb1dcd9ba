"""The server of the live view: the page and its data, on loopback only.

    /                     the page; its files beside it
    /scene                what there is (JSON)
    /status?since=k       the frames after the first k, and what a running scene does (JSON)
    /span?color=name      range of a value (JSON)
    /frame/<n>?...        a packet (see ``packet.py``) of what changes, at time code n
    /still?...            a packet of what does not
    POST /live/<order>    play, pause or reset

``world=&apart=&color=&map=&low=&high=`` choose what is in a packet. Errors are JSON, ``error``.
"""

from __future__ import annotations

import contextlib
import functools
import json
import math
import threading
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib import resources
from pathlib import Path
from typing import Any, Self
from urllib.parse import parse_qs, urlsplit

from ... import validate
from ...output.colors import MAPS
from ..render.paint import Paint
from .footage import Choice, Footage
from .live import Live

OWNER = "view"
LOOPBACK = "127.0.0.1"
HOSTS = ("127.0.0.1", "localhost")
KINDS = {".html": "text/html", ".css": "text/css", ".js": "text/javascript"}
# Nothing else of the package can be asked for, by whatever path.
HOME = resources.files("particlesim.pictures.view") / "page"
FILES = {f"/{file.name}": file for file in HOME.iterdir() if Path(file.name).suffix in KINDS}
PAGE = {"/": FILES["/index.html"], **FILES}
HEADERS = {
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; "
    "connect-src 'self'; img-src data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'",
}
IDLE = 60.0  # seconds until a silent connection is closed
POLL = 0.05  # seconds until closing is noticed


class Server:
    """Serves footage, or a running scene, until it is closed.

    Args:
        source: What to show; it stays the caller's to close.
        port: 0: any that is free.
        color: Name of the value that the page colours by at first.

    Raises:
        OSError: The port is taken.
    """

    def __init__(self, source: Footage | Live, port: int = 0, color: str | None = None):
        self.live = source if isinstance(source, Live) else None
        self.source, self.color = source, color
        try:
            self._http = ThreadingHTTPServer((LOOPBACK, port), functools.partial(Handler, self))
        except OSError as error:
            raise OSError(
                f"{OWNER}: port must be free, got {port} ({error.strerror}); choose another, or 0."
            ) from error
        self._http.daemon_threads = True
        self._thread = threading.Thread(
            target=self._http.serve_forever, args=[POLL], name="particlesim-view", daemon=True
        )
        self._thread.start()

    @property
    def footage(self) -> Footage:
        """What is shown now; a running scene has another after each reset."""
        return self.source.footage if isinstance(self.source, Live) else self.source

    @property
    def url(self) -> str:
        """Where the page is."""
        return f"http://{LOOPBACK}:{self._http.server_address[1]}/"

    def close(self) -> None:
        """Serve no longer."""
        self._http.shutdown()
        self._http.server_close()
        self._thread.join()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: Any) -> None:
        self.close()

    # What the page asks for -----------------------------------------------------------------

    def scene(self) -> dict[str, Any]:
        """What there is."""
        found = {**self.footage.scene(), "live": self._state(), "color": self.color}
        return found if self.live is None else {**found, "title": self.live.title}

    def status(self, since: int) -> dict[str, Any]:
        """The frames after the first ``since``, and what a running scene does."""
        footage = self.footage
        footage.refresh()
        return {"take": footage.take, "frames": footage.frames[since:], "live": self._state()}

    def _state(self) -> dict[str, Any] | None:
        return None if self.live is None else self.live.state()

    def choice(self, words: dict[str, str]) -> Choice:
        """What of a frame is asked for."""
        world = words.get("world")
        return Choice(
            None if world is None else int(_number("world", world)),
            words.get("apart") == "1",
            self._paint(words),
        )

    def _paint(self, words: dict[str, str]) -> Paint:
        name = words.get("color")
        if name is None:
            return Paint()
        color_map = validate.choice(OWNER, "map", words.get("map", "viridis"), MAPS)
        if "low" in words and "high" in words:
            span = _number("low", words["low"]), _number("high", words["high"])
        else:
            span = self.footage.span(name)
        return Paint(name, color_map, span)


class Handler(BaseHTTPRequestHandler):
    """Answers one connection.

    Args:
        shown: Whose it is.
        *rest: Of the base class.
    """

    protocol_version = "HTTP/1.1"
    server_version, sys_version = "particlesim", ""
    timeout = IDLE
    # Head and body are two writes; waiting to join them would cost 40 ms each time.
    disable_nagle_algorithm = True

    def __init__(self, shown: Server, *rest: Any):
        self.shown = shown
        super().__init__(*rest)

    def do_GET(self) -> None:
        """Send the page, or data."""
        self._answer(self._get)

    def do_POST(self) -> None:
        """Take an order for a running scene."""
        self.close_connection = True  # what comes along is not read
        self._answer(self._post)

    def log_message(self, *arguments: Any) -> None:
        """Say nothing: the terminal belongs to the user."""

    def _answer(self, work: Any) -> None:
        """Send what ``work`` makes, or what is wrong."""
        with contextlib.suppress(ConnectionError, TimeoutError):
            if not self._from_here():
                self._error(HTTPStatus.FORBIDDEN, "view: requests must come from its own page")
                return
            try:
                kind, body = work()
            except LookupError as error:
                self._error(HTTPStatus.NOT_FOUND, str(error.args[0]))
            except ValueError as error:
                self._error(HTTPStatus.BAD_REQUEST, str(error))
            except Exception as error:  # whatever it is, the page has to say it
                self._error(HTTPStatus.INTERNAL_SERVER_ERROR, f"{type(error).__name__}: {error}")
            else:
                self._send(HTTPStatus.OK, kind, body)

    def _from_here(self) -> bool:
        """Not by another name that leads here, and not from another site's page."""
        host = self.headers.get("Host", "")
        name, _, port = host.partition(":")
        origin = self.headers.get("Origin")
        ours = name.lower() in HOSTS and (not port or port.isdecimal())
        return ours and origin in (None, f"http://{host}")

    def _get(self) -> tuple[str, bytes]:
        url = urlsplit(self.path)
        words = {name: values[-1] for name, values in parse_qs(url.query).items()}
        if url.path in PAGE:
            page = PAGE[url.path]
            return f"{KINDS[Path(page.name).suffix]}; charset=utf-8", page.read_bytes()
        shown, footage = self.shown, self.shown.footage
        if url.path == "/scene":
            return _json(shown.scene())
        if url.path == "/status":
            return _json(shown.status(int(_number("since", words.get("since", "0")))))
        if url.path == "/span":
            return _json(footage.span(words.get("color", "")))
        if url.path == "/still":
            return "application/octet-stream", footage.still(shown.choice(words))
        start, _, number = url.path.rpartition("/")
        if start == "/frame":
            return "application/octet-stream", footage.packet(
                _number("frame", number), shown.choice(words)
            )
        raise LookupError(f"{OWNER}: there is nothing at {url.path!r}")

    def _post(self) -> tuple[str, bytes]:
        start, _, order = self.path.rpartition("/")
        orders = {} if self.shown.live is None else {
            "play": self.shown.live.play,
            "pause": self.shown.live.pause,
            "reset": self.shown.live.reset,
        }  # fmt: skip
        if start != "/live" or order not in orders:
            raise LookupError(f"{OWNER}: there is nothing to do at {self.path!r}")
        orders[order]()
        return _json(self.shown.status(0))

    def _send(self, status: HTTPStatus, kind: str, body: bytes) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        for name, value in HEADERS.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def _error(self, status: HTTPStatus, message: str) -> None:
        self._send(status, *_json({"error": " ".join(message.split())}))


def _json(value: Any) -> tuple[str, bytes]:
    return "application/json", json.dumps(value, allow_nan=False).encode()


def _number(name: str, text: str) -> float:
    """A finite number of a query."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise validate.fail(OWNER, name, "be a finite number", text, "give one")
    return value
