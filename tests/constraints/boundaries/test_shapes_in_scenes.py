"""Boundaries of every further shape in scenes: worlds, restarts, execution, how they are drawn."""

import numpy as np
import pytest

import particlesim as ps
from cases.worlds import equal_alone, goes_on_after_reset_and_save

pytestmark = pytest.mark.slow

CUBE = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
        (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]  # fmt: skip
CORNERS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)


def shapes(k):
    """A container and obstacles of world k, moving in all worlds but the first."""
    spin, speed, touch = 0.7 * k, 0.5 * k, {"friction": 0.3, "restitution": 0.4}
    rng = np.random.default_rng(3)
    turned = ps.sample.rotate(CORNERS * 0.15, (1, 2, 3), 0.5) + np.array([0.5, -0.6, 0])
    keys = ps.Keyframes([0.0, 0.2, 0.5], [(0, 0, 0), (0, 0.05 * k, 0), (0, 0, 0.1 * k)])
    heights = rng.uniform(-0.05, 0.05, (9, 9 + k))
    nodes = np.stack(np.meshgrid(*3 * [np.linspace(-0.4, 0.4, 17)], indexing="ij"))
    ball = ps.SDFBoundary(np.linalg.norm(nodes, axis=0) - 0.2, (-0.4, -0.4, -0.4), 0.05, **touch)
    bowl = ps.SphereBoundary((0, 0, 0), 2.0 + 0.1 * k) | ps.SphereBoundary(
        (0.3, 0.3, 0.3), 0.1, inside=False, friction=0.9
    )
    return [
        ps.CylinderBoundary((0, 0, -1), (0, 0, 1), 1, True, angular_velocity=(0, 0, spin), **touch),
        ps.CapsuleBoundary((-0.5, -0.5, 0), (-0.3, -0.6, 0.5), 0.1, motion=keys, **touch),
        ps.MeshBoundary(turned, CUBE, velocity=(0, 0.1 * speed, 0), **touch),
        ps.MeshBoundary(CORNERS[:3] * 0.4, [(0, 1, 2)], sheet=True, thickness=0.01, **touch),
        ps.HeightfieldBoundary(heights, (-1, -0.8, -1), 0.25, **touch),
        ball,
        bowl,
    ]


def scene(k, count=60):
    rng = np.random.default_rng(count + k)
    result = ps.Scene()
    result.add_particles(
        rng.uniform(-0.6, 0.6, (count + k, 3)), radius=rng.uniform(0, 0.05, count + k),
        velocity=rng.normal(0, 2, (count + k, 3)),
    )  # fmt: skip
    result.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    for each in shapes(k):
        result.add_constraint(each)
    return result


def test_a_world_in_a_batch_equals_it_alone(precision, device, simulate):
    """Bit for bit, each with shapes of its own."""
    knobs = {"dt": 1 / 60, "substeps": 4, "precision": precision}
    equal_alone(simulate, [scene(k) for k in range(1, 4)], device, 30, **knobs)


def test_reset_and_checkpoint(tmp_path, device, simulate):
    scenes = [scene(k) for k in range(1, 3)]
    goes_on_after_reset_and_save(simulate, scenes, device, tmp_path / "half.npz")


def test_graph_equals_threads(simulate):
    """Bit for bit, however the launches are cut."""
    found = []
    for knobs in ({"execution": "graph"}, {"execution": "threads", "threads": 3}):
        sim = simulate(scene(1, count=2000), **knobs)
        sim.run(5)
        found.append((sim.position, sim.velocity))
        sim.close()
    assert np.array_equal(found[0], found[1])


def test_forces_and_torques_outlive_a_checkpoint(tmp_path, device, simulate):
    parts = scene(1)
    sim = simulate(parts, device)
    sim.run(10)
    sim.save(tmp_path / "done.npz")
    again = ps.Simulation.load(tmp_path / "done.npz", parts, device=device)
    drum = parts.constraints[0]
    assert np.array_equal(sim.force(drum), again.force(drum))
    assert np.array_equal(sim.torque(drum), again.torque(drum))
    assert np.abs(sim.torque(drum)).max() > 0


def volume(shape):
    """Within triangles that go round counterclockwise as seen from outside."""
    a, b, c = np.moveaxis(shape["points"][shape["triangles"]], 1, 0)
    return (a * np.cross(b, c)).sum() / 6


def test_they_are_drawn():
    """By triangles whose volume is that of the shape, to what 48 points on a circle leave."""
    (capsule,) = ps.CapsuleBoundary((-0.5, 1, 0), (0.3, 2, 0.5), 0.4).shapes()
    length = np.linalg.norm([0.8, 1, 0.5])
    expected = np.pi * 0.4**2 * length + 4 / 3 * np.pi * 0.4**3
    assert volume(capsule) == pytest.approx(expected, rel=0.01)
    assert not capsule["container"]
    (drum,) = ps.CylinderBoundary((0, 0, -1), (0, 0, 1), 0.4, True).shapes()
    assert volume(drum) == pytest.approx(2 * np.pi * 0.4**2, rel=0.01)
    assert drum["container"]
    (cube,) = ps.MeshBoundary(CORNERS, np.array(CUBE)[:, ::-1]).shapes()
    assert volume(cube) == pytest.approx(8)
    lens, = (ps.SphereBoundary((0, 0, 0), 0.5, False) & ps.SphereBoundary((0.5, 0, 0), 0.5, False)
             ).shapes()  # fmt: skip
    # Two caps of height r / 2: 5 pi r^3 / 12; marching cubes of 64 cells along 1.1 m.
    assert abs(volume(lens)) == pytest.approx(5 * np.pi * 0.5**3 / 12, rel=0.01)


def test_recordings_hold_all_shapes(tmp_path, device, simulate):
    sim = simulate(scene(1), device)
    sim.run(frames=2, record=tmp_path / "out.usda")
    text = (tmp_path / "out.usda").read_text()
    names = {type(each).__name__ for each in shapes(1)}
    assert all(f'"{name}' in text for name in names), names
