"""The live view serves its page and its data, and that to nobody else."""

import re
import socket
from importlib import resources

import pytest

from particlesim.pictures.view.server import PAGE, Server

from .drops import ask, port_of, refusal


def test_the_page_is_whole_and_needs_nothing_from_elsewhere(shared):
    home = resources.files("particlesim.pictures.view") / "page"
    assert set(PAGE) == {"/", *(f"/{path.name}" for path in home.iterdir())}
    kinds = {"html": "text/html", "css": "text/css", "js": "text/javascript"}
    for path, file in PAGE.items():
        status, found, body = ask(shared, path)
        assert status == 200
        assert found == f"{kinds[file.name.rpartition('.')[2]]}; charset=utf-8"
        text = body.decode()
        assert not re.search(r"https?://|\bimport\(|@import", text)
        for name in re.findall(r'(?:from|src=|href=) ?"([^"]+)"', text):
            assert name == "data:," or f"/{name.removeprefix('./')}" in PAGE


@pytest.mark.parametrize(
    "path",
    [
        "/server.py", "/../server.py", "/page/../../cli.py", "/%2e%2e/%2e%2e/cli.py",
        "/..%2f..%2fcli.py", "//etc/passwd", "/etc/passwd", "/page/index.html", "/frame",
        "/index.html/..", "/live/play", "/style.css/", "/\\..\\cli.py",
    ],
)  # fmt: skip
def test_no_other_file_can_be_had(shared, path):
    message = refusal(shared, path, 404)
    assert message.startswith("view: there is nothing at")


def test_bad_questions(shared):
    assert "from 0 to 6, got 99" in refusal(shared, "/frame/99", 404)
    assert "got 1.5" in refusal(shared, "/frame/1.5", 404)
    for path, words in {
        "/frame/nan": "frame must be a finite number",
        "/frame/": "frame must be a finite number",
        "/frame/1?world=7": "world must be one that is there, got 7",
        "/frame/1?world=x": "world must be a finite number",
        "/frame/1?color=heat": "color must be one of mass, speed, got 'heat'",
        "/frame/1?color=speed&map=blue": "map must be one of viridis",
        "/frame/1?color=speed&low=0&high=inf": "high must be a finite number",
        "/span": "color must be one of",
        "/status?since=k": "since must be a finite number",
    }.items():
        assert words in refusal(shared, path, 400)
    status, _, body = ask(shared, "/live/play", "POST")
    assert status == 404 and b"nothing to do" in body
    assert ask(shared, "/", "DELETE")[0] == 501


def test_only_loopback_is_served(shared):
    socket.create_connection(("127.0.0.1", port_of(shared)), timeout=5).close()
    # Another address of the same computer, which a server on all addresses would answer.
    with pytest.raises(OSError):
        socket.create_connection(("127.0.0.2", port_of(shared)), timeout=5).close()


def test_foreign_names_and_pages_are_refused(shared):
    here = f"127.0.0.1:{port_of(shared)}"
    for host in (here, f"localhost:{port_of(shared)}", "localhost"):
        assert ask(shared, "/scene", Host=host)[0] == 200
    for host in ("evil.example", "127.0.0.1.evil.example", "localhost:80@evil.example", "", None):
        assert ask(shared, "/scene", Host=host)[0] == 403
        assert ask(shared, "/", Host=host)[0] == 403
    assert ask(shared, "/live/reset", "POST", Host=here, Origin="http://evil.example")[0] == 403
    assert ask(shared, "/scene", Host=here, Origin="null")[0] == 403
    assert ask(shared, "/scene", Host=here, Origin=f"http://{here}")[0] == 200


def test_a_port_that_is_taken(shared):
    with pytest.raises(OSError, match=r"view: port must be free, got \d+ .*; choose another"):
        Server(shared.source, port_of(shared))
