"""Blender opens recordings as they are. Needs a Python with bpy: this one, or BLENDER_PYTHON."""

import importlib
import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import particlesim as ps

PYTHON = os.environ.get("BLENDER_PYTHON") or (
    sys.executable if importlib.util.find_spec("bpy") else None
)
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(PYTHON is None, reason="no bpy; set BLENDER_PYTHON to a Python that has it"),
]
SCRIPT = Path(__file__).parents[2] / "data" / "blender_import.py"
FRAMES = 4


def blender(path, frame=FRAMES):
    """What Blender makes of a recording at a frame."""
    command = [PYTHON, str(SCRIPT), str(path), str(frame), str(path.with_suffix(".png"))]
    done = subprocess.run(command, capture_output=True, text=True, timeout=280)
    assert done.returncode == 0, done.stderr
    (line,) = [line for line in done.stdout.splitlines() if line.startswith("REPORT")]
    return json.loads(line.removeprefix("REPORT"))


def record(tmp_path, name, worlds=None, build=None, **options):
    """A recording of a ready scene's first frames, and the simulation at the last of them."""
    module = importlib.import_module(f"particlesim.scenes.{name}")
    sim = ps.Simulation(module.build(**(build or {})), module.settings, device="cpu", worlds=worlds)
    path = tmp_path / f"{name}.usda"
    with ps.UsdRecorder(sim, path, frames=FRAMES, **options) as out:
        for frame in range(FRAMES + 1):
            out.write()
            if frame < FRAMES:
                sim.step()
    return sim, path


def clouds(report):
    """The point clouds, by name."""
    return {each["name"]: each for each in report["objects"] if each["type"] == "POINTCLOUD"}


def check_cloud(cloud, sim, rows, fields):
    """Positions, velocities, radii, ids and fields are those of the simulation."""
    held = cloud["attributes"]
    x, v, r = sim.position[rows], sim.velocity[rows], sim.model.column("radius")[rows]
    assert cloud["count"] == len(x)
    # Blender keeps the file's axes in the data, and turns the object.
    np.testing.assert_allclose(held["position"], x, rtol=1e-6, atol=1e-7)
    # Authored per second of playback, which takes as long as the simulated one.
    np.testing.assert_allclose(held["velocity"], v, rtol=1e-5, atol=1e-7)
    np.testing.assert_allclose(held["radius"], r, rtol=1e-6)
    np.testing.assert_array_equal(held["pid"], np.arange(sim.particle_count)[rows])
    for name in fields:
        np.testing.assert_allclose(held[name], sim.get(name)[rows], rtol=1e-6)


def check_picture(report):
    assert report["picture"]["share"] > 0.002
    assert report["picture"]["spread"] > 0.01  # lit, not flat


def test_dam_break(tmp_path):
    sim, path = record(
        tmp_path, "dam_break", build={"spacing": 0.1}, fields=["density", "force"], color_by="speed"
    )
    report = blender(path)
    assert report["range"] == [0, FRAMES]
    assert report["types"]["POINTCLOUD"] == report["types"]["CAMERA"] == 1
    assert report["types"]["MESH"] == report["types"]["CURVES"] == 1  # the tank and its edges
    (water,) = clouds(report).values()
    check_cloud(water, sim, slice(None), ["density", "force"])
    assert np.ptp(np.array(water["attributes"]["displayColor"])[:, :3], axis=0).max() > 0.1
    check_picture(report)


def test_chain(tmp_path):
    sim, path = record(tmp_path, "chain")
    report = blender(path)
    groups = [group for group in sim.scenes[0].groups if len(group)]
    found = clouds(report)
    assert len(found) == len(groups)
    for group in groups:
        check_cloud(found[group.name], sim, group.slice, [])
    links = sum(len(part.links()) for part in [*sim.interactions, *sim.constraints])
    broken = sum(int(part.broken.sum()) for part in sim.constraints if hasattr(part, "broken"))
    ends = [each["count"] for each in report["objects"] if each["type"] == "CURVES"]
    assert 2 * (links - broken) in ends
    check_picture(report)


def test_a_batch_on_a_grid(tmp_path):
    sim, path = record(tmp_path, "dam_break", worlds=4, build={"spacing": 0.1}, layout="grid")
    report = blender(path)
    found = clouds(report)
    assert len(found) == 4
    for cloud in found.values():
        check_cloud(cloud, sim, slice(0, sim.particle_count // 4), [])  # all worlds are alike
    # Side by side on the ground, which for Blender is x and y.
    places = {tuple(np.round(cloud["at"], 3)) for cloud in found.values()}
    assert len(places) == 4 and all(place[2] == 0 for place in places)
    check_picture(report)


def test_instances(tmp_path):
    sim, path = record(tmp_path, "dam_break", build={"spacing": 0.1}, instancer=True)
    report = blender(path)
    assert report["instances"] == sim.particle_count


def test_cloth(tmp_path):
    scene = ps.Scene()
    corners = [(0, 1, 0), (1, 1, 0), (1, 1, 1), (0, 1, 1)]
    scene.add_particles(corners, radius=0.1, group="sheet", triangles=[(0, 3, 2), (0, 2, 1)])
    scene.add_particles([(0.5, 2, 0.5)], radius=0.2, group="ball")
    scene.add_interaction(ps.UniformGravity())
    sim = ps.Simulation(scene, device="cpu")
    path = tmp_path / "cloth.usda"
    sim.run(FRAMES, record=path)
    report = blender(path)
    assert report["types"]["MESH"] == report["types"]["POINTCLOUD"] == 1
    assert [each["count"] for each in report["objects"] if each["type"] == "MESH"] == [4]
    check_picture(report)
