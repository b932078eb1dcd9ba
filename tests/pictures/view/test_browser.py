"""The live view's page in a real browser, where there is one: what is drawn, and what keys do."""

import base64
import shutil
import time

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, Vt

import particlesim as ps
from particlesim.output.usd.recorder import UsdRecorder
from particlesim.pictures.view.footage import Footage
from particlesim.pictures.view.live import Live
from particlesim.pictures.view.server import Server

playwright = pytest.importorskip("playwright.sync_api")

SIZE = {"width": 400, "height": 300}
FRAMES, WORLDS = 8, 3
# Without a graphics card.
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
# What is in the picture, drawn anew: WebGL keeps nothing of the last one.
PIXELS = """() => {
  const { gl } = particlesim.screen.painter;
  particlesim.screen.draw(particlesim.state, 1);
  const { width, height } = particlesim.screen.canvas;
  const bytes = new Uint8Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
  let text = "";
  for (let k = 0; k < bytes.length; k += 8192) {
    text += String.fromCharCode(...bytes.subarray(k, k + 8192));
  }
  return [width, height, btoa(text)];
}"""
CAMERA = "[particlesim.screen.camera.distance, ...particlesim.screen.camera.target]"
FRAME = "particlesim.screen.packets.frame.arrays"
READY = "() => particlesim.screen.packets.still && particlesim.shown === particlesim.state.index"


@pytest.fixture(scope="module")
def browser():
    """A browser without a window."""
    with playwright.sync_playwright() as started:
        found = next(filter(None, map(shutil.which, NAMES)), None)
        try:
            opened = started.chromium.launch(executable_path=found, args=FLAGS)
        except playwright.Error as error:
            pytest.skip(f"no browser: {str(error).splitlines()[0]}")
        yield opened
        opened.close()


@pytest.fixture
def show(browser):
    """A function that opens a server's page; nothing may be complained of on the console."""
    said, pages = [], []

    def open_page(server, start="#paused"):
        page = browser.new_page(viewport=SIZE)
        pages.append(page)
        page.on("console", lambda message: said.append(f"{message.type}: {message.text}"))
        page.on("pageerror", lambda error: said.append(str(error)))
        page.goto(server.url + start)
        page.wait_for_function(READY)
        if not page.evaluate("() => !!particlesim.screen.painter.gl"):
            pytest.skip("no WebGL 2")
        return page

    yield open_page
    for page in pages:
        page.close()
    assert [line for line in said if "400 (Bad Request)" not in line] == []


def pixels(page):
    """The picture, (height, width, 4), rows from below."""
    width, height, text = page.evaluate(PIXELS)
    return np.frombuffer(base64.b64decode(text), np.uint8).reshape(height, width, 4).astype(int)


def simulation(worlds=None):
    scene = ps.Scene()
    x = ps.sample.box((0.1, 0.2, 0.1), (0.6, 0.7, 0.6), 0.1)
    blue = scene.add_particles(
        x, velocity=x - 0.4, radius=0.05, group="blue", color=(0.02, 0.1, 0.9)
    )
    scene.add_interaction(ps.UniformGravity((3, -9.81, 0)))
    scene.add_constraint(ps.Distance([blue.indices[:2]]))
    scene.add_constraint(ps.BoxBoundary((0, 0, 0), (1, 1, 1)))
    return ps.Simulation(scene, ps.Settings(dt=0.03, substeps=2), device="cpu", worlds=worlds)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    path, sim = tmp_path_factory.mktemp("seen") / "blue.usda", simulation(WORLDS)
    with UsdRecorder(sim, path, frames=FRAMES) as recorder:
        recorder.write()
        for _ in range(FRAMES):
            sim.step()
            recorder.write()
    return path


@pytest.fixture(scope="module")
def server(recorded):
    with Server(Footage(recorded)) as serving:
        yield serving


def wait_frame(page, index):
    page.wait_for_function(f"() => particlesim.shown === {index}")


def test_spheres_are_true_spheres(show, tmp_path):
    """Two that cut into each other, against the nearest hit of every pixel's ray."""
    centers, radii = np.array([(0, 0, 0), (0.5, 0.3, 0.7)]), np.array([1.0, 0.5])
    stage = Usd.Stage.CreateNew(str(tmp_path / "two.usda"))
    points = UsdGeom.Points.Define(stage, "/two")
    points.CreatePointsAttr(Vt.Vec3fArray([Gf.Vec3f(*c) for c in centers.tolist()]))
    points.CreateWidthsAttr(Vt.FloatArray((2 * radii).tolist()))
    points.SetWidthsInterpolation("vertex")
    points.CreateDisplayColorPrimvar("vertex").Set([Gf.Vec3f(1, 0, 0), Gf.Vec3f(0, 0, 1)])
    stage.Save()
    with Server(Footage(tmp_path / "two.usda")) as serving:
        page = show(serving)
        page.evaluate(
            "() => { particlesim.state.grid = false; particlesim.screen.camera.turn(0.6, -0.2); }"
        )
        seen = pixels(page)
        camera = page.evaluate(
            "() => { const { axes, target, distance, slope } = particlesim.screen.camera;"
            " return [axes, target, distance, slope]; }"
        )
    axes, target, distance, slope = (np.array(each) for each in camera)
    height, width = seen.shape[:2]
    y, x = np.mgrid[:height, :width] + 0.5
    rays = np.stack(
        [(2 * x - width) / height * slope, (2 * y / height - 1) * slope, -1 + 0 * x], -1
    )
    rays = rays / np.linalg.norm(rays, axis=-1, keepdims=True) @ axes
    eye = target + distance * axes[2]
    hits = []
    for center, radius in zip(centers, radii, strict=True):
        along = rays @ (center - eye)
        inside = radius**2 - ((center - eye) @ (center - eye) - along**2)
        hits.append(np.where(inside > 0, along - np.sqrt(np.maximum(inside, 0)), np.inf))
    nearest = np.where(np.isfinite(np.min(hits, axis=0)), np.argmin(hits, axis=0), -1)
    red, blue = seen[..., 0] - seen[..., 2] > 40, seen[..., 2] - seen[..., 0] > 60
    drawn = np.where(red, 0, np.where(blue, 1, -1))
    assert all((nearest == k).sum() > 500 for k in (-1, 0, 1))
    # Only pixels whose ray all but grazes an edge may be off, in single precision.
    assert (drawn != nearest).mean() < 2e-4


def test_frames_camera_slider_and_keys(show, server):
    page = show(server)
    first = pixels(page)
    assert len(np.unique(first.reshape(-1, 4), axis=0)) > 100  # light and shade, not one colour
    blue = (first[..., 2] - first[..., 0] > 60).mean()
    assert 0.02 < blue < 0.9
    # Frames: the slider, keys, and the ends.
    page.locator("#slider").fill("5")
    wait_frame(page, 5)
    fifth = pixels(page)
    assert (fifth != first).any(axis=-1).mean() > 0.01
    assert "frame 5 / 8" in page.locator("#time").inner_text()
    assert "0.1500 s" in page.locator("#time").inner_text()
    for key, index in (("ArrowRight", 6), ("ArrowLeft", 5), ("End", FRAMES), ("Home", 0)):
        page.keyboard.press(key)
        wait_frame(page, index)
        assert page.locator("#slider").input_value() == str(index)
    assert np.array_equal(pixels(page), first)
    # The camera: drag, wheel and back.
    page.mouse.move(60, 150)
    page.mouse.down()
    page.mouse.move(140, 120, steps=4)
    page.mouse.up()
    turned = pixels(page)
    assert (turned != first).any(axis=-1).mean() > 0.05
    page.mouse.wheel(0, 300)
    page.wait_for_function(
        "() => particlesim.screen.camera.distance > 1.2 * particlesim.screen.camera.size"
    )
    smaller = pixels(page)
    assert (smaller[..., 2] - smaller[..., 0] > 60).mean() < 0.8 * blue
    # Space plays: frames follow each other, from the last to the first again.
    page.keyboard.press("Space")
    page.wait_for_function("() => particlesim.state.index >= 3")
    page.wait_for_function("() => particlesim.state.index < 3")
    page.keyboard.press("Space")
    assert not page.evaluate("() => particlesim.state.playing")
    assert page.locator("#error").is_hidden()


def test_worlds_colors_and_boundaries(show, server):
    page = show(server, "#paused&frame=4")
    count = len(simulation().position)
    assert page.locator("#counts").inner_text().startswith(f"{WORLDS * count} particles")
    everything = pixels(page)
    page.locator("#world").select_option("1")
    page.wait_for_function(f"() => {FRAME}['thing.ball'].count === {count}")
    page.wait_for_function(READY)
    assert page.locator("#counts").inner_text().startswith(f"{count} particles")
    one = pixels(page)
    # One world, as large as fits: more of the picture than each of three had.
    assert (one[..., 2] - one[..., 0] > 60).sum() > (
        everything[..., 2] - everything[..., 0] > 60
    ).sum() / 2
    page.locator("#canvas").focus()
    page.keyboard.press("ArrowDown")
    page.wait_for_function("() => particlesim.state.world === 2")
    page.keyboard.press("ArrowUp")
    page.wait_for_function(f"() => particlesim.state.world === 1 && ({READY})()")
    # By value: the legend has the range that the server says, which may be set.
    page.locator("#color").select_option("speed")
    page.wait_for_function(f"() => {FRAME}['thing.ball_color'].count === {count}")
    assert page.locator("#scale").is_visible() and page.locator("#groups").is_hidden()
    low, high = (float(page.locator(end).input_value()) for end in ("#low", "#high"))
    assert 0 <= low < high
    by_value = pixels(page)
    assert (by_value != one).any(axis=-1).mean() > 0.02
    page.locator("#map").select_option("gray")
    page.locator("#high").fill(str(low + 1e-3))
    page.locator("#high").press("Enter")
    page.wait_for_function(f"() => {FRAME}['thing.ball_color'].values.every((x) => x > 200)")
    # Boundaries: each way looks different, and without them there is less.
    page.evaluate("() => { particlesim.change({ grid: false }); }")
    looks = {}
    for way in ("solid", "edges", "none"):
        page.locator("#boundaries").select_option(way)
        page.wait_for_function(f"() => particlesim.state.boundaries === '{way}'")
        looks[way] = pixels(page)
    assert (looks["solid"] != looks["edges"]).any() and (looks["edges"] != looks["none"]).any()
    assert (looks["solid"] != looks["none"]).any(axis=-1).mean() > 0.02


def test_touch_pinches_and_moves(show, server):
    page = show(server)
    before = page.evaluate(f"() => {CAMERA}")
    page.evaluate("""() => {
      const canvas = particlesim.screen.canvas;
      canvas.setPointerCapture = () => {};
      const send = (type, pointerId, clientX, clientY) => canvas.dispatchEvent(
        new PointerEvent(type, { pointerId, clientX, clientY, pointerType: "touch", buttons: 1 }));
      send("pointerdown", 1, 200, 160);
      send("pointerdown", 2, 240, 160);
      send("pointermove", 1, 180, 190);
      send("pointermove", 2, 260, 190);
      send("pointerup", 1, 180, 190);
      send("pointerup", 2, 260, 190);
    }""")
    after = page.evaluate(f"() => {CAMERA}")
    assert after[0] < 0.6 * before[0]  # twice as far apart: half the distance, less what is bent
    assert np.abs(np.subtract(after[1:], before[1:])).max() > 0.01


def test_errors_are_in_the_page(show, recorded, tmp_path):
    shutil.copy(recorded, tmp_path)
    shutil.copytree(recorded.with_suffix(".clips"), tmp_path / "blue.clips")
    clip = tmp_path / "blue.clips" / "f.000003.usdc"
    clip.write_bytes(clip.read_bytes()[:500])
    with Server(Footage(tmp_path / "blue.usda")) as serving:
        page = show(serving)
        page.locator("#slider").fill("3")
        message = page.locator("#message")
        message.wait_for()
        assert "frame 3 must have a file that can be read to its end" in message.inner_text()
        page.keyboard.press("ArrowRight")
        wait_frame(page, 4)
        assert page.locator("#error").is_hidden()


def test_a_running_scene_plays_pauses_and_resets(show):
    running = Live(simulation(), FRAMES, title="blue")
    try:
        with Server(running) as serving:
            page = show(serving, "")
            wait_frame(page, FRAMES)  # it starts by itself
            page.wait_for_function("() => !particlesim.state.playing")
            end = pixels(page)
            page.keyboard.press("r")
            page.wait_for_function("() => particlesim.film.codes.length === 1")
            wait_frame(page, 0)
            assert running.done == 0 and (pixels(page) != end).any()
            page.keyboard.press("Space")
            page.wait_for_function("() => particlesim.state.index >= 2")
            page.keyboard.press("Space")
            deadline = time.monotonic() + 10
            while running.playing and time.monotonic() < deadline:
                page.wait_for_timeout(20)
            assert not running.playing
    finally:
        running.close()
