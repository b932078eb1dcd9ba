"""The live view's server: what it sends is what was simulated, and it sends it to nobody else."""

import http.client
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from importlib import resources

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom

import particlesim as ps
from particlesim import cli
from particlesim.output import colors
from particlesim.output.usd.recorder import UsdRecorder
from particlesim.pictures.view.footage import Footage
from particlesim.pictures.view.live import Live
from particlesim.pictures.view.packet import unpacked
from particlesim.pictures.view.server import PAGE, Server

FRAMES, WORLDS, DROPS = 6, 4, 8
COLOR = (0.1, 0.4, 0.9)


def build():
    """Drops that fall in a box, and a rope of two beads."""
    scene = ps.Scene()
    rng = np.random.default_rng(1)
    radii = np.linspace(0.01, 0.02, DROPS)
    scene.add_particles(
        rng.uniform(0.2, 0.8, (DROPS, 3)), velocity=rng.normal(0, 1, (DROPS, 3)), radius=radii,
        group="drops", color=COLOR,
    )  # fmt: skip
    rope = scene.add_particles([(0.4, 0.9, 0.5), (0.6, 0.9, 0.5)], radius=0.05, group="rope")
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    scene.add_constraint(ps.Distance(rope.indices[None]))
    scene.add_constraint(ps.BoxBoundary((0, 0, 0), (1, 1, 1)))
    return scene


def simulation(worlds=None):
    return ps.Simulation(build(), ps.Settings(dt=0.02, substeps=2), device="cpu", worlds=worlds)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A recording of four worlds in one place, and position and velocity of every frame."""
    path = tmp_path_factory.mktemp("recorded") / "drops.usda"
    sim, states = simulation(WORLDS), []
    for world in range(WORLDS):  # or all would be the same
        sim.world(world).velocity = sim.world(world).velocity * (1 + world)
    with UsdRecorder(sim, path, frames=FRAMES, fields=["mass"]) as recorder:
        for frame in range(FRAMES + 1):
            if frame:
                sim.step()
            recorder.write()
            states.append((sim.position.copy(), sim.velocity.copy()))
    return path, states


@pytest.fixture(scope="module")
def shared(recorded):
    with Server(Footage(recorded[0])) as server:
        yield server


def ask(server, path, method="GET", **headers):
    """Status, kind and body of an answer; the path is sent as it is."""
    connection = http.client.HTTPConnection("127.0.0.1", port_of(server), timeout=30)
    try:
        connection.putrequest(method, path, skip_host="Host" in headers)
        for name, value in headers.items():
            if value is not None:
                connection.putheader(name, value)
        connection.endheaders()
        answer = connection.getresponse()
        return answer.status, answer.getheader("Content-Type"), answer.read()
    finally:
        connection.close()


def port_of(server):
    return int(server.url.rstrip("/").rpartition(":")[2])


def get(server, path, method="GET"):
    """JSON of a good answer."""
    status, kind, body = ask(server, path, method)
    assert (status, kind) == (200, "application/json"), body
    return json.loads(body)


def packet(server, path):
    status, kind, body = ask(server, path)
    assert (status, kind) == (200, "application/octet-stream"), body
    return unpacked(body)


def refusal(server, path, status):
    """The words of a refusal."""
    found, kind, body = ask(server, path)
    assert (found, kind) == (status, "application/json"), body
    return json.loads(body)["error"]


def srgb(linear):
    return np.rint(255 * colors.encoded(np.asarray(linear))).astype(int)


# What is sent


def test_scene_says_what_there_is(shared):
    scene = get(shared, "/scene")
    assert scene["frames"] == list(range(FRAMES + 1))
    assert scene["worlds"] == list(range(WORLDS)) and scene["coinciding"]
    assert [group["name"] for group in scene["groups"]] == ["drops", "rope", "Distance"]
    assert scene["groups"][0]["color"] == srgb(COLOR).tolist()
    assert scene["fields"] == ["mass", "speed"]
    assert scene["frameTime"] == pytest.approx(0.02) and scene["fps"] == 50
    assert scene["up"] == [0, 1, 0] and not scene["live"]
    assert set(scene["maps"]) == set(colors.MAPS)
    # Both ends of a map, as it is shown.
    assert scene["maps"]["gray"][0] == [0, 0, 0] and scene["maps"]["gray"][-1] == [255, 255, 255]


@pytest.mark.parametrize("frame", [0, 3, FRAMES])
def test_a_frame_is_what_was_simulated(shared, recorded, frame):
    header, arrays = packet(shared, f"/frame/{frame}")
    x = recorded[1][frame][0].astype(np.float32).reshape(WORLDS, -1, 3)
    assert header["frame"] == frame
    balls = arrays["thing.ball"].reshape(WORLDS, -1, 4)
    assert np.array_equal(balls[..., :3], x)
    # Radii are diameters in the file, so halves of single precision: exact.
    radii = np.float32(2 * np.append(np.linspace(0.01, 0.02, DROPS), [0.05, 0.05])) / 2
    assert np.array_equal(balls[..., 3], np.tile(radii, (WORLDS, 1)))
    drop = arrays["thing.ball_color"].reshape(WORLDS, -1, 4)[0, 0]
    assert np.abs(drop - [*srgb(COLOR), 255]).max() <= 1  # steps of the table
    # The rope from bead to bead, of half their radius each.
    cones = arrays["thing.cone"].reshape(WORLDS, 2, 3)
    assert np.array_equal(cones, x[:, -2:])
    assert header["arrays"]["thing.cone"]["radius"] == pytest.approx(0.025)


def test_still_is_sent_once(shared):
    _, frame = packet(shared, "/frame/1")
    _, still = packet(shared, "/still")
    assert not any(name.startswith("boundary") for name in frame)
    assert not any(name.startswith("thing") for name in still)
    # A box has 12 edges and 12 triangles in each world, and is clear.
    assert still["boundary.edge"].shape == (WORLDS * 12 * 2, 3)
    assert still["boundary.veil"].shape == (WORLDS * 12 * 3, 3)
    assert 0 < still["boundary.veil_color"][0, 3] < 255
    lengths = np.linalg.norm(np.diff(still["boundary.edge"].reshape(-1, 2, 3), axis=1), axis=2)
    assert np.array_equal(lengths, np.ones_like(lengths))


def test_one_world_and_worlds_side_by_side(shared, recorded):
    x = recorded[1][2][0].reshape(WORLDS, -1, 3)
    for world in range(WORLDS):
        _, arrays = packet(shared, f"/frame/2?world={world}&apart=1")
        assert np.array_equal(arrays["thing.ball"][:, :3], x[world].astype(np.float32))
    _, arrays = packet(shared, "/frame/2?apart=1")
    _, still = packet(shared, "/still?apart=1")
    shift = arrays["thing.ball"].reshape(WORLDS, -1, 4)[..., :3] - x
    # Each world as a whole, on the ground, none into another: they have gaps.
    # Single precision rounds at 2^-24 of 2.
    assert np.ptp(shift, axis=1).max() < 1e-6 and np.abs(shift[..., 1]).max() < 1e-6
    corners = still["boundary.edge"].reshape(WORLDS, -1, 3)
    lower, upper = corners.min(axis=1), corners.max(axis=1)
    for a in range(WORLDS):
        for b in range(a):
            assert ((lower[a] > upper[b]) | (lower[b] > upper[a])).any()


def test_color_by_a_value(shared, recorded):
    speed = np.linalg.norm(recorded[1][4][1], axis=1)
    low, high = get(shared, "/span?color=speed")
    assert 0 <= low < high
    _, arrays = packet(shared, f"/frame/4?color=speed&map=magma&low={low}&high={high}")
    expected = srgb(colors.colored(speed, "magma", low, high))
    # One step of the map, where single precision lies across the middle of two: below 4 of 255.
    assert np.abs(arrays["thing.ball_color"][:, :3] - expected).max() <= 4
    # Without a range, that of the recording.
    _, again = packet(shared, "/frame/4?color=speed&map=magma")
    assert np.array_equal(again["thing.ball_color"], arrays["thing.ball_color"])
    # All have one mass: one colour is sent for all.
    _, plain = packet(shared, "/frame/4?color=mass&low=0&high=1")
    assert len(plain["thing.ball_color"]) < len(plain["thing.ball"])


def test_triangles_and_their_normals(tmp_path):
    """A square in one plane has its normal everywhere, and its own opacity."""
    scene = ps.Scene()
    square = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    scene.add_particles(square, group="sheet", triangles=[(0, 1, 2), (0, 2, 3)])
    sim = ps.Simulation(scene, device="cpu")
    sim.run(frames=1, record=str(tmp_path / "sheet.usda"))
    with Server(Footage(tmp_path / "sheet.usda")) as server:
        _, arrays = packet(server, "/frame/1")
    corners = np.array(square)[[0, 1, 2, 0, 2, 3]]
    assert np.array_equal(arrays["thing.corner"], corners)
    assert np.array_equal(arrays["thing.normal"][:, :3], np.tile([0, 0, 127], (6, 1)))
    assert arrays["thing.corner_color"].shape == (1, 4)


def test_any_usd_file(tmp_path):
    """Not of this program: one sphere, which stands still, and nothing that moves."""
    stage = Usd.Stage.CreateNew(str(tmp_path / "ball.usda"))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    ball = UsdGeom.Sphere.Define(stage, "/ball")
    ball.CreateRadiusAttr(2.0)
    ball.CreateDisplayColorAttr([Gf.Vec3f(1, 0, 0)])
    ball.AddTranslateOp().Set(Gf.Vec3d(1, 2, 3))
    UsdGeom.Sphere.Define(stage, "/hidden").CreatePurposeAttr("guide")
    stage.Save()
    with Server(Footage(tmp_path / "ball.usda")) as server:
        scene = get(server, "/scene")
        assert scene["frames"] == [0] and scene["worlds"] == [] and scene["up"] == [0, 0, 1]
        header, arrays = packet(server, "/still")
        assert arrays["thing.ball"].tolist() == [[1, 2, 3]]
        assert header["arrays"]["thing.ball"]["radius"] == 2
        assert arrays["thing.ball_color"].tolist() == [[255, 0, 0, 255]]
        assert packet(server, "/frame/0")[1] == {}


# What is refused


def test_the_page_is_whole_and_needs_nothing_from_elsewhere(shared):
    files = {
        path.name for path in (resources.files("particlesim.pictures.view") / "page").iterdir()
    }
    assert files == {name for name, _ in PAGE.values()}
    for path, (_, kind) in PAGE.items():
        status, found, body = ask(shared, path)
        assert status == 200 and found == f"{kind}; charset=utf-8"
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


# Files that change, and files that are broken


def copied(recorded, folder):
    path = shutil.copy(recorded[0], folder)
    shutil.copytree(recorded[0].with_suffix(".clips"), folder / "drops.clips")
    return folder / os.path.basename(path)


@pytest.mark.parametrize("broken", [0, 3])
def test_a_truncated_frame_says_so_and_the_others_are_there(recorded, tmp_path, broken):
    path = copied(recorded, tmp_path)
    clip = path.with_suffix(".clips") / f"f.{broken:06d}.usdc"
    clip.write_bytes(clip.read_bytes()[:700])
    with Server(Footage(path)) as server:
        assert get(server, "/scene")["frames"] == list(range(FRAMES + 1))
        for _ in range(2):
            message = refusal(server, f"/frame/{broken}", 400)
            assert f"frame {broken} must have a file that can be read to its end" in message
            assert clip.name in message
        assert "boundary.veil" in packet(server, "/still")[1]
        get(server, "/span?color=speed")
        _, arrays = packet(server, "/frame/4?apart=1")
        assert len(arrays["thing.ball"]) == WORLDS * (DROPS + 2)


def test_a_missing_frame_is_none(recorded, tmp_path):
    path = copied(recorded, tmp_path)
    (path.with_suffix(".clips") / "f.000002.usdc").unlink()
    with Server(Footage(path)) as server:
        assert get(server, "/scene")["frames"] == [0, 1, 3, 4, 5, 6]
        refusal(server, "/frame/2", 404)


def test_a_recording_that_grows_and_is_replaced(tmp_path):
    path, sim = tmp_path / "growing.usda", simulation()
    with UsdRecorder(sim, path, frames=9) as recorder:
        recorder.write()
        with Server(Footage(path)) as server:
            assert get(server, "/scene")["frames"] == [0]
            for frame in (1, 2, 3):
                sim.step()
                recorder.write()
                status = get(server, f"/status?since={frame}")
                assert status == {"take": 0, "frames": [frame], "live": None}
                _, arrays = packet(server, f"/frame/{frame}")
                assert np.array_equal(arrays["thing.ball"][:, :3], sim.position)
            other = simulation(2)
            with UsdRecorder(other, path, frames=1, overwrite=True) as again:
                again.write()
                status = get(server, "/status?since=0")
                assert status["take"] > 0 and status["frames"] == [0]
                assert get(server, "/scene")["worlds"] == [0, 1]
                assert len(packet(server, "/frame/0")[1]["thing.ball"]) == 2 * (DROPS + 2)
            path.unlink()
            assert "FileNotFoundError" in refusal(server, "/status", 500)


# Running scenes


@pytest.fixture
def live():
    running = Live(simulation(), FRAMES, title="drops")
    with Server(running) as server:
        yield server
    running.close()


def wait_for(condition, seconds=60.0):
    """Until something is so, or the time is up."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it took too long"
        time.sleep(0.01)


def test_a_scene_runs_while_it_is_watched(live):
    scene = get(live, "/scene")
    assert scene["live"] and scene["frames"] == [0] and scene["title"] == "drops"
    assert get(live, "/status")["live"] == {
        "playing": False, "done": 0, "planned": FRAMES, "error": None,
    }  # fmt: skip
    assert get(live, "/live/play", "POST")["live"]["planned"] == FRAMES
    wait_for(lambda: get(live, "/status")["live"]["done"] == FRAMES)
    status = get(live, "/status")
    assert status["frames"] == list(range(FRAMES + 1)) and not status["live"]["playing"]
    other = simulation()
    for frame in range(FRAMES + 1):
        _, arrays = packet(live, f"/frame/{frame}")
        assert np.array_equal(arrays["thing.ball"][:, :3], other.position)
        other.step()


def test_pause_and_reset(live):
    start = packet(live, "/frame/0")[1]["thing.ball"]
    get(live, "/live/play", "POST")
    wait_for(lambda: get(live, "/status")["live"]["done"] >= 1)
    get(live, "/live/pause", "POST")
    wait_for(lambda: not get(live, "/status")["live"]["playing"])
    take = get(live, "/status")["take"]
    status = get(live, "/live/reset", "POST")
    assert status["take"] != take and status["frames"] == [0]
    assert status["live"]["done"] == 0 and not status["live"]["playing"]
    assert np.array_equal(packet(live, "/frame/0")[1]["thing.ball"], start)
    refusal(live, "/frame/1", 404)
    # Takes do not pile up: this one and the one before are kept.
    for _ in range(3):
        get(live, "/live/reset", "POST")
    assert len(list(live.footage.path.parent.glob("*.usda"))) == 2
    get(live, "/live/play", "POST")
    wait_for(lambda: get(live, "/status")["live"]["done"] == FRAMES)


def test_a_scene_that_fails_says_why_and_can_be_reset(monkeypatch):
    sim = simulation()
    step = sim.step

    def fail():
        if sim.frame == 2:
            raise RuntimeError("particle 3 of world 0 has left")
        step()

    monkeypatch.setattr(sim, "step", fail)
    running = Live(sim, FRAMES)
    with Server(running) as server:
        get(server, "/live/play", "POST")
        wait_for(lambda: get(server, "/status")["live"]["error"])
        status = get(server, "/status")
        assert status["live"]["error"] == "particle 3 of world 0 has left"
        assert status["frames"] == [0, 1, 2] and not status["live"]["playing"]
        packet(server, "/frame/2")
        status = get(server, "/live/reset", "POST")
        assert status["live"]["error"] is None and status["frames"] == [0]
    folder = running.footage.path.parent
    running.close()
    assert not folder.exists()


# The command


def start(*arguments):
    """The command in a process of its own, its page's address, and where it keeps things."""
    program = [sys.executable, "-m", "particlesim.cli", "view", "--no-browser", *arguments]
    process = subprocess.Popen(program, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
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
