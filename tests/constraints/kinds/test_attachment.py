"""Attachments: points at rest and on paths, their force, and tearing off."""

import numpy as np
import pytest

import particlesim as ps


@pytest.mark.slow
def test_a_hanging_weight_is_held_by_its_weight(device, simulate, precision):
    """m g, at the point or, compliant, m g alpha below it; one too heavy is torn off and falls."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1, 0, 0), (2, 0, 0)], mass=[1.0, 1.0, 3.0])
    part = scene.add_constraint(
        ps.Attachment([0, 1, 2], compliance=[0.0, 0.01, 0.0], break_force=20.0)
    )
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    scene.add_interaction(ps.Drag(10.0))
    sim = simulate(scene, device, substeps=10, precision=precision)
    sim.run(300)
    assert sim.position[0] == pytest.approx([0, 0, 0], abs=1e-6)
    assert sim.position[1] == pytest.approx([1, -0.0981, 0], abs=1e-4)
    assert sim.force(part)[:2] == pytest.approx(9.81, rel=1e-3)
    assert sim.broken(part).tolist() == [False, False, True]
    assert sim.position[2, 1] < -5.0


@pytest.mark.slow
def test_paths_are_exact_and_of_each_world(device, simulate, precision):
    """Between keyframes on straight lines by each world's own times; then at rest."""
    times, points = [0.0, 0.1, 0.3], np.array([(0, 0, 0), (1, 0, 0), (1, 2, 0)], dtype=float)
    scenes = []
    for slower in (1.0, 2.0):
        scene = ps.Scene()
        scene.add_particles([(0, 0, 0), (5, 0, 0)])
        both = np.stack([points, points + np.array([5, 0, 0])], axis=1)
        scene.add_constraint(ps.Attachment([0, 1], both, times=np.multiply(times, slower)))
        scenes.append(scene)
    sim = simulate(scenes, device, precision=precision)
    for frame in range(1, 80):
        sim.step()
        for w, slower in enumerate((1.0, 2.0)):
            t = 0.01 * frame / slower
            at = [np.interp(t, times, points[:, k]) for k in range(3)]
            found = sim.world(w).position
            near = 8 * float(np.finfo(precision).eps) * 5
            assert np.abs(found - np.array([at, np.add(at, (5, 0, 0))])).max() < near
    alone = simulate(scenes[1], device, precision=precision)
    alone.run(79)
    assert np.array_equal(alone.position, sim.world(1).position)
    assert np.array_equal(alone.velocity, sim.world(1).velocity)


@pytest.mark.slow
def test_bad_input(refused):
    with refused("times must ascend"):
        ps.Attachment([0], [(0, 0, 0), (1, 0, 0)], times=[1.0, 1.0])
    with refused("target must have shape"):
        ps.Attachment([0, 1], np.zeros((2, 3, 3)), times=[0.0, 1.0])
    with refused("target must be given with times"):
        ps.Attachment([0], times=[0.0, 1.0])
    with refused("target must have shape"):
        ps.Attachment([0, 1], np.zeros((3, 3)))
