"""The automatic camera sees the scene, whatever it is."""

import numpy as np
import pytest

import particlesim as ps
from particlesim.output.usd.recording import Recording
from particlesim.pictures.render.camera import ROOM, Framing
from particlesim.pictures.render.geometry import Geometry
from particlesim.pictures.render.overview import overview
from particlesim.pictures.render.stage import follow, look_at, overlook

ASPECT = 16 / 9


def outside(camera, x, r, aspect=ASPECT, room=ROOM):
    """How far spheres stick out of the picture, relative to the distance: at most 0 where seen."""
    right, up, back = ((np.asarray(x) - camera.position) @ camera.axes.T).T
    worst = -np.inf
    for along, k in ((right, camera.slope * aspect / room), (up, camera.slope / room)):
        for side in (along, -along):
            worst = max(worst, np.max(side + k * back + r * np.hypot(1.0, k)))
    return worst / np.linalg.norm(camera.position - camera.target)


@pytest.mark.parametrize("up", [(0, 1, 0), (0, 0, 1), (1, 0, 0)])
@pytest.mark.parametrize("largest", [0.0, 0.1, 1.0, 30.0])
def test_every_sphere_of_small_scenes_is_wholly_in_the_picture(up, largest):
    rng = np.random.default_rng(int(10 * largest))
    for _ in range(200):
        count = rng.integers(1, 21)
        stretch = 10.0 ** rng.uniform(-2, 2, 3)
        x = rng.normal(0, 1, (count, 3)) * stretch + rng.normal(0, 10, 3)
        r = rng.uniform(0, largest, count)
        camera = ps.Camera.around(x, up, ASPECT, r)
        # Rounding of positions and distances of some 1e3 in float64.
        assert outside(camera, x, r) < 1e-10
        # And none is at the eye, where it would fill the picture.
        apart = np.linalg.norm(x - camera.position, axis=1) - r
        assert apart.min() > 0.1 * np.linalg.norm(np.ptp(x, axis=0))


def test_a_picture_shows_two_spheres_that_are_far_apart():
    x = np.array([(-10, 0, -10), (10, 0, 10)])
    for radius in (0.5, 1.0):
        scene = ps.Scene()
        scene.add_particles(x, radius=radius)
        picture = ps.Simulation(scene, device="cpu").render(width=480, height=270).array
        camera = ps.Camera.around(x, (0, 1, 0), 480 / 270, radius)
        drawn = (picture != picture[0, 0]).any(axis=2)
        for center in x:
            right, up, back = camera.axes @ (center - camera.position)
            k = camera.slope
            column = int(240 * (1 - right / back / (k * 480 / 270)))
            row = int(135 * (1 + up / back / k))
            assert drawn[row, column]


def test_a_solar_system_is_in_the_picture():
    orbit = np.array([0, 0.39, 0.72, 1, 1.52, 5.2, 9.58, 19.2, 30.05])
    angle = 2.4 * np.arange(9)
    x = np.stack([orbit * np.cos(angle), orbit * np.sin(angle), 0 * orbit], axis=1)
    assert outside(ps.Camera.around(x, (0, 0, 1), ASPECT, 0.7), x, 0.7) < 1e-10


def test_a_camera_of_many_frames_sees_each():
    rng = np.random.default_rng(4)
    framing = Framing((0, 1, 0), ASPECT)
    frames = [rng.normal(0, 1, (5, 3)) * k for k in (1, 3, 10)]
    for x in frames:
        framing.add(x, 0.2)
    together = ps.Camera.around(np.concatenate(frames), (0, 1, 0), ASPECT, 0.2)
    np.testing.assert_allclose(framing.camera().position, together.position)
    for x in frames:
        assert outside(framing.camera(), x, 0.2) < 1e-10


@pytest.mark.parametrize("supersample", [1, 2])
def test_particles_under_a_pixel_are_drawn(supersample):
    x = np.random.default_rng(1).uniform(-1, 1, (40, 3))
    scene = ps.Scene()
    scene.add_particles(x, radius=1e-6)
    picture = ps.Simulation(scene, device="cpu").render(
        width=320, height=180, supersample=supersample, shadows=False
    )
    camera = ps.Camera.around(x, (0, 1, 0), 320 / 180, 1e-6)
    drawn = (picture.array != picture.array[0, 0]).any(axis=2)
    right, up, back = ((x - camera.position) @ camera.axes.T).T
    column = 160 * (1 - right / back / (camera.slope * 320 / 180))
    row = 90 * (1 + up / back / camera.slope)
    for c, r in zip(column, row, strict=True):
        near = drawn[int(r - 0.5) : int(r + 0.5) + 1, int(c - 0.5) : int(c + 0.5) + 1]
        assert near.any()


def high_drop(count):
    """A flat heap of spheres, and one far above."""
    x = np.random.default_rng(2).uniform(-1, 1, (count, 3)) * (1, 0.1, 1)
    x[0] = (0, 20, 0)
    geometry = Geometry()
    geometry.add_spheres(x, 0.02, (1.0, 0.0, 0.0))
    return geometry, x


def test_one_high_drop_of_many_does_not_rule_the_picture():
    geometry, x = high_drop(3000)
    camera = overview(geometry, (0, 1, 0), ASPECT)
    alone = ps.Camera.around(x[1:], (0, 1, 0), ASPECT, 0.02)
    # No farther than for all but the drop: 1 % is left out at each edge.
    assert np.linalg.norm(camera.position - camera.target) < 1.1 * np.linalg.norm(
        alone.position - alone.target
    )
    right, up, back = ((x[1:] - camera.position) @ camera.axes.T).T
    k = camera.slope
    out = (np.abs(right) > -back * k * ASPECT) | (np.abs(up) > -back * k)
    assert out.mean() <= 4 * 0.01


def test_all_of_a_small_scene_is_shown():
    geometry, x = high_drop(1000)
    assert outside(overview(geometry, (0, 1, 0), ASPECT), x, 0.02) < 1e-6  # in single precision


def test_what_spreads_a_little_is_shown_whole():
    x = np.random.default_rng(3).uniform(-1, 1, (3000, 3))
    geometry = Geometry()
    geometry.add_spheres(x, 0.02, (1.0, 0.0, 0.0))
    assert outside(overview(geometry, (0, 1, 0), ASPECT), x, 0.02) < 1e-6


@pytest.mark.parametrize("speed", [0.0, 8.0])
def test_a_film_sees_all_of_its_frames(tmp_path, speed):
    scene = ps.Scene()
    start = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], dtype=float)
    scene.add_particles(start, velocity=speed * (start - 0.5), radius=0.1)
    path = tmp_path / "out.usda"
    sim = ps.Simulation(scene, ps.Settings(dt=0.1), device="cpu")
    sim.run(10, record=path)
    recording = Recording("render", path)
    own = look_at(recording.stage, 0).camera
    camera = overlook(recording, recording.frames(), ASPECT, own)
    # The recording's own camera is kept where nothing leaves its picture.
    assert (camera is own) == (speed == 0.0)
    for x in (start, sim.position):
        assert outside(camera, x, 0.1, room=1.0) < 1e-6


def test_a_camera_that_follows(tmp_path):
    """It sees all particles in every frame from as near as their own size asks, and never turns."""
    scene = ps.Scene()
    start = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], dtype=float)
    scene.add_particles(start, velocity=(50, 20, -30) + 0.5 * (start - 0.5), radius=0.1)
    scene.add_constraint(ps.PlaneBoundary((0, -100, 0), (0, 1, 0)))
    path = tmp_path / "out.usda"
    sim, places = ps.Simulation(scene, ps.Settings(dt=0.1), device="cpu"), [start]
    sim.run(10, record=path, progress=lambda *_: places.append(sim.position))
    recording = Recording("render", path)
    cameras = follow(recording, recording.frames(), ASPECT, None)
    assert len(cameras) == 11
    for camera, x in zip(cameras, places, strict=True):
        assert outside(camera, x, 0.1, room=1.0) < 1e-5
        np.testing.assert_allclose(camera.axes, cameras[0].axes, atol=1e-12)
        way = camera.position - cameras[0].position
        np.testing.assert_allclose(way, x.mean(axis=0) - start.mean(axis=0), atol=1e-4)
    far = overlook(recording, recording.frames(), ASPECT, None)
    near = np.linalg.norm(cameras[0].position - places[-1].mean(axis=0)) > 50  # where it was
    distance = np.linalg.norm(cameras[-1].position - places[-1].mean(axis=0))
    assert near and distance < 0.15 * np.linalg.norm(far.position - places[-1].mean(axis=0))
    own = ps.Camera((0, 0, 9), (0, 0, 0))
    asked = follow(recording, recording.frames(), ASPECT, own)
    np.testing.assert_array_equal(asked[0].position, own.position)
    np.testing.assert_allclose(asked[-1].position - own.position, way, atol=1e-12)
