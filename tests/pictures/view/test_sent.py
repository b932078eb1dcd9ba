"""What the live view sends is what was simulated."""

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom

import particlesim as ps
from particlesim.output import colors
from particlesim.pictures.view.footage import Footage
from particlesim.pictures.view.server import Server

from .drops import COLOR, DROPS, FRAMES, WORLDS, get, packet, srgb


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
