"""The command view: it serves until it is stopped, and refuses what it cannot show."""

import http.client
import json
import re
import signal
import socket
import subprocess
import sys
import threading

import pytest

from particlesim import cli

from .drops import unpacked


def start(*arguments):
    """The command in a process of its own, its page's address, and where it keeps things."""
    program = [sys.executable, "-m", "particlesim.cli", "view", "--no-browser", *arguments]
    process = subprocess.Popen(
        program, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        # What a script starts in the background has it ignored, and so would this.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    watch = threading.Timer(120, process.kill)
    watch.start()
    line = process.stdout.readline()
    watch.cancel()
    found = re.search(r"http://127\.0\.0\.1:(\d+)/", line)
    if not found:
        process.kill()
    assert found, line + process.stderr.read()
    return process, int(found[1])


@pytest.mark.parametrize("sign", [signal.SIGINT, signal.SIGTERM])
def test_the_command_serves_until_it_is_stopped(recorded, sign):
    process, port = start(str(recorded[0]), "--color", "speed")
    try:
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
        connection.request("GET", "/scene")
        assert json.loads(connection.getresponse().read())["color"] == "speed"
    finally:
        process.send_signal(sign)
        _, said = process.communicate(timeout=60)
    assert process.returncode == 0 and said == ""


def test_the_command_refuses_what_it_cannot_show(recorded, tmp_path, capsys):
    taken = socket.create_server(("127.0.0.1", 0))
    port = str(taken.getsockname()[1])
    broken = tmp_path / "broken.usda"
    broken.write_text("#usda 1.0\n(((")
    for arguments, words in {
        (str(tmp_path / "none.usda"),): "does not exist",
        (str(broken),): "be a USD file that can be read",
        (str(recorded[0]), "--port", "70000"): "port must be at most 65535",
        (str(recorded[0]), "--port", "-1"): "port must be a whole number of at least 0",
        (str(recorded[0]), "--port", port): "port must be free",
        (str(recorded[0]), "--color", "heat"): "color must be one of mass, speed",
        ("no_scene",): "SCENE must be a ready scene",
    }.items():
        assert cli.main(["view", "--no-browser", *arguments]) == 2
        lines = capsys.readouterr().err.splitlines()
        assert len(lines) == 1 and words in lines[0], lines
    taken.close()


def test_the_command_runs_a_scene(tmp_path):
    text = "import particlesim as ps\nsettings = ps.Settings(dt=0.02)\nframes = 3\n"
    text += "def build(height=1.0):\n    scene = ps.Scene()\n"
    text += "    scene.add_particles([(0, height, 0)], radius=0.1)\n    return scene\n"
    (tmp_path / "ball.py").write_text(text)
    words = ["--set", "height=4", "--worlds", "2", "--device", "cpu", "--color", "mass"]
    process, port = start(str(tmp_path / "ball.py"), *words)
    try:
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
        connection.request("GET", "/scene")
        scene = json.loads(connection.getresponse().read())
        assert scene["live"] and scene["worlds"] == [0, 1] and scene["fields"] == ["mass", "speed"]
        connection.request("GET", "/frame/0?world=1")
        ball = unpacked(connection.getresponse().read())[1]["thing.ball"]
        assert ball[0, 1] == 4
        connection.request("GET", "/status")
        assert json.loads(connection.getresponse().read())["live"]["planned"] == 3
    finally:
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=60)
    assert process.returncode == 0
