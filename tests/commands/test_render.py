"""``particlesim render``: pictures and films of recordings and scenes, and what it refuses."""

import importlib.util
import os
import re
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image as Pillow
from PIL import ImageSequence

import particlesim as ps
from particlesim import cli
from particlesim.pictures.render import film
from particlesim.pictures.render.film import Gif, Mp4, open_film

SMALL = ("--width", "64", "--height", "36")
BLENDER = os.environ.get("BLENDER_PYTHON") or (
    sys.executable if importlib.util.find_spec("bpy") else None
)


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Five frames, 0 to 4, of a ball that falls past a camera, at 25 frames a second."""
    scene = ps.Scene()
    scene.add_particles([(0, 2, 0), (0.5, 2, 0)], radius=0.3, group="balls")
    scene.add_interaction(ps.UniformGravity())
    scene.add_constraint(ps.BoxBoundary((-1, 0, -1), (1, 3, 1)))
    path = tmp_path_factory.mktemp("recorded") / "fall.usda"
    sim = ps.Simulation(scene, ps.Settings(dt=0.04), device="cpu")
    sim.run(frames=4, record=path, fields=["speed"])
    return path


@pytest.fixture
def render(recording, tmp_path, capsys):
    """Run the command on the recording; its output file, and what it printed."""

    def run(out, *words, file=recording, code=0):
        target = tmp_path / out
        assert (
            cli.main(["render", str(file), "--out", str(target), *SMALL, *map(str, words)]) == code
        )
        said = capsys.readouterr()
        if code:
            assert re.fullmatch(r"error: .+\n", said.err), said.err
            assert list(tmp_path.iterdir()) == []
            return said.err
        return target, said.out

    return run


def pixels(path):
    return np.asarray(Pillow.open(path).convert("RGB")).astype(int)


def test_a_picture_of_a_frame(render, tmp_path):
    last, said = render("last.png")
    assert said.startswith("frame 4 of ") and pixels(last).shape == (36, 64, 3)
    fourth, _ = render("4.png", "--frame", 4)
    first, _ = render("0.png", "--frame", 0)
    np.testing.assert_array_equal(pixels(last), pixels(fourth))
    assert np.abs(pixels(last) - pixels(first)).max() > 50
    assert sorted(each.name for each in tmp_path.iterdir()) == ["0.png", "4.png", "last.png"]


def test_a_camera_of_ones_own(render):
    # From straight above, the ball under the camera is in the middle of the picture.
    picture, _ = render("a.png", "--camera", "0.5,8,0.01,0.5,0,0,20", "--no-ground", "--frame", 0)
    middle, corner = pixels(picture)[18, 32], pixels(picture)[2, 2]
    assert np.abs(middle - corner).max() > 60


def test_a_value_has_the_same_colours_in_all_frames(render):
    slow, _ = render("a.png", "--color", "speed", "--color-range", "0,9", "--frame", 0)
    fast, _ = render("b.png", "--color", "speed", "--color-range", "0,0.5", "--frame", 4)
    # viridis: from violet, with more blue than green, to yellow, the other way.
    assert (pixels(slow)[..., 2] - pixels(slow)[..., 1]).max() > 30
    assert (pixels(fast)[..., 1] - pixels(fast)[..., 2]).max() > 60


def test_a_gif_of_all_or_some_frames(render):
    whole, said = render("all.gif")
    assert "5 frames" in said and "25 a second" in said
    frames = [f.info["duration"] for f in ImageSequence.Iterator(Pillow.open(whole))]
    assert frames == [40] * 5
    some, _ = render("some.gif", "--frames", "1:4:2")
    frames = [f.info["duration"] for f in ImageSequence.Iterator(Pillow.open(some))]
    assert frames == [80] * 2  # every other frame, twice as long


def test_a_gif_holds_the_pictures(render):
    still, _ = render("still.png", "--frame", 2)
    moving, _ = render("moving.gif", "--frames", "2:")
    # 255 colours of few shades: none is far off.
    assert np.abs(pixels(moving) - pixels(still)).mean() < 3


def test_an_mp4_plays(render):
    pytest.importorskip("imageio_ffmpeg")
    video, _ = render("a.mp4", "--height", 35)  # odd: players need it even
    command = [film.ffmpeg(), "-i", str(video), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    found = subprocess.run(command, capture_output=True, timeout=60, check=True)
    frames = np.frombuffer(found.stdout, dtype=np.uint8).reshape(-1, 36, 64, 3)
    assert len(frames) == 5 and b"25 fps" in found.stderr
    assert np.abs(frames[0].astype(int) - frames[4]).max() > 50


def test_a_scene_is_drawn_as_it_starts(render):
    picture, said = render("a.png", "--set", "count=20", file="pile")
    assert said.startswith("frame 0 of pile") and np.ptp(pixels(picture)) > 50


@pytest.mark.parametrize(
    ("out", "words", "message"),
    [
        ("a.bmp", (), "end in .png"),
        ("a.png", ("--frame", "9"), "from 0 to 4, got 9"),
        ("a.png", ("--frames", "0:2"), "of a film"),
        ("a.gif", ("--frame", "1"), "of one picture"),
        ("a.png", ("--follow",), "--follow must be of a film"),
        ("a.gif", ("--frames", "7:9"), "some of 0 to 4"),
        ("a.gif", ("--frames", "1-3"), "first:last"),
        ("a.gif", ("--frames", "1:3:0"), "first:last"),
        ("a.png", ("--camera", "1,2,3"), "px,py,pz"),
        ("a.png", ("--color", "heat"), "one of speed"),
        ("a.png", ("--color", "speed", "--color-range", "1"), "low,high"),
        ("a.png", ("--color", "speed", "--color-map", "vridis"), "viridis"),
        ("a.png", ("--engine", "raster"), "warp, cycles"),
        ("a.png", ("--engine", "cycles", "--python", "/no/python"), "interpreter with bpy"),
        ("none/a.png", (), "existing folder"),
    ],
)
def test_what_does_not_fit_is_one_line(render, out, words, message):
    assert message in render(out, *words, code=2)


def test_files_that_are_not_there(render, tmp_path_factory):
    assert "does not exist" in render("a.png", file="none.usda", code=2)
    assert "ready scene" in render("a.png", file="none", code=2)
    assert "run it first" in render("a.gif", file="pile", code=2)
    broken = tmp_path_factory.mktemp("broken") / "b.usda"
    broken.write_text("no usd")
    assert "can be read" in render("a.png", file=broken, code=2)


def test_nothing_is_overwritten_unasked(render, recording, tmp_path, capsys):
    target, _ = render("a.png", "--frame", 0)
    before = target.read_bytes()
    assert cli.main(["render", str(recording), "--out", str(target)]) == 2
    assert "--overwrite" in capsys.readouterr().err and target.read_bytes() == before
    render("a.png", "--overwrite")
    assert target.read_bytes() != before


@pytest.mark.skipif(importlib.util.find_spec("bpy") is not None, reason="bpy is here")
def test_a_missing_bpy_is_named(render, monkeypatch):
    monkeypatch.delenv("BLENDER_PYTHON", raising=False)
    assert "pip install bpy" in render("a.png", "--engine", "cycles", code=2)


def test_missing_programs_are_named(render, monkeypatch):
    monkeypatch.setattr("shutil.which", lambda name: None)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    assert "particlesim[video]" in render("a.mp4", code=2)
    monkeypatch.setitem(sys.modules, "PIL", None)
    assert "particlesim[render]" in render("a.png", code=2)


@pytest.mark.parametrize("suffix", [".gif", ".mp4"])
def test_a_film_that_fails_leaves_nothing(tmp_path, suffix):
    if suffix == ".mp4":
        pytest.importorskip("imageio_ffmpeg")
    with pytest.raises(KeyError), open_film(tmp_path / f"a{suffix}", 10.0) as made:
        assert isinstance(made, Gif if suffix == ".gif" else Mp4)
        made.add(np.zeros((20, 30, 3), dtype=np.uint8))
        raise KeyError
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.skipif(BLENDER is None, reason="no bpy; set BLENDER_PYTHON to a Python that has it")
def test_cycles_shows_what_the_preview_shows(render):
    options = ("--color", "speed", "--color-range", "0,0.5", "--frame", 4)
    quick, _ = render("quick.png", *options)
    fine, _ = render(
        "fine.png", *options, "--engine", "cycles", "--samples", 16, "--python", BLENDER
    )
    # Both are yellow where the balls are, and there alone.
    masks = [p[..., 0] - p[..., 2] > 40 for p in (pixels(quick), pixels(fine))]
    overlap = (masks[0] & masks[1]).sum() / (masks[0] | masks[1]).sum()
    assert masks[0].sum() > 30 and overlap > 0.6
