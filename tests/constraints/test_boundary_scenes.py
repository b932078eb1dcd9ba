"""Boundaries in scenes: worlds, execution, shapes, arguments."""

import numpy as np
import pytest

import particlesim as ps
from cases.worlds import equal_alone

INF = np.inf


@pytest.fixture
def hail(scene_of):
    """A function: particles over a slope in a box, with parameters of their own."""

    def make(k):
        rng = np.random.default_rng(k)
        normal = (0.1 * k, 1, 0)
        return scene_of(
            rng.uniform(0.2, 2, (30 + k, 3)),
            ps.PlaneBoundary((0, 0.1 * k, 0), normal, friction=0.2 * k, restitution=0.3 * k),
            ps.BoxBoundary((0, -INF, 0), (2 + k, 3, 2), friction=0.1 * k, restitution=0.2 * k),
            ps.SphereBoundary((1, 1, 1), 0.3 + k, k > 0, friction=0.1 * k, restitution=0.3 * k),
            radius=rng.uniform(0, 0.1, 30 + k), velocity=rng.normal(0, 3, (30 + k, 3)),
            gravity=True,
        )  # fmt: skip

    return make


def test_a_world_in_a_batch_equals_it_alone(precision, device, simulate, hail):
    """Bit for bit, with parameters of its own."""
    knobs = {"dt": 1 / 60, "substeps": 5, "precision": precision}
    equal_alone(simulate, [hail(k) for k in range(3)], device, 60, **knobs)


def test_graph_equals_threads(simulate, scene_of):
    """Bit for bit, however the launches are cut."""
    rng = np.random.default_rng(0)
    x, v = rng.uniform(0.2, 1.8, (5000, 3)), rng.normal(0, 3, (5000, 3))
    found = []
    for knobs in ({"execution": "graph"}, {"execution": "threads", "threads": 3}):
        box = ps.BoxBoundary((0, 0, 0), (2, 2, 2), friction=0.3, restitution=0.5)
        scene = scene_of(x, box, velocity=v, radius=0.01, gravity=True)
        sim = simulate(scene, dt=1 / 60, substeps=4, **knobs)
        sim.run(5)
        found.append((sim.position, sim.velocity))
        sim.close()
    assert np.array_equal(found[0], found[1])


def test_shapes():
    """What exports draw."""
    (plane,) = ps.PlaneBoundary((1, 2, 3), (0, 0, 5)).shapes()
    assert plane["kind"] == "plane"
    assert plane["normal"].tolist() == [0, 0, 1]
    assert plane["point"].tolist() == [1, 2, 3]
    (box,) = ps.BoxBoundary((0, 0, 0), (1, INF, 1)).shapes()
    assert box["kind"] == "box"
    assert box["upper"].tolist() == [1, INF, 1]
    (ball,) = ps.SphereBoundary((1, 0, 0), 2.0, inside=False).shapes()
    assert ball["kind"] == "sphere"
    assert not ball["container"]


def test_no_bounce_pass_without_restitution(device, simulate, scene_of):
    """A plane of e = 0 has no pass after the velocities."""
    for e in (0.0, 0.5):
        scene = scene_of([(0, 1, 0)], ps.PlaneBoundary((0, 0, 0), (0, 1, 0), restitution=e))
        keys = [key for _, key, _ in simulate(scene, device).explain().launches]
        assert any("bounce" in key for key in keys) == (e > 0)


def test_nothing_to_hold(device, simulate, scene_of):
    """No particles, all pinned, no time."""
    plane = ps.PlaneBoundary((0, 0, 0), (0, 1, 0), restitution=0.5)
    simulate(scene_of(np.zeros((0, 3)), plane), device).run(2)
    sim = simulate(scene_of([(0, -1, 0)], plane, pinned=True), device)
    sim.run(2)
    sim.substep(0.0)
    assert np.array_equal(sim.position, [(0, -1, 0)])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ps.PlaneBoundary((0, 0), (0, 1, 0)), r"PlaneBoundary: point must have shape \(3,"),
        (lambda: ps.PlaneBoundary((0, 0, 0), (0, 0, 0)), "PlaneBoundary: normal must have a direc"),
        (lambda: ps.PlaneBoundary((0, np.nan, 0), (0, 1, 0)), "PlaneBoundary: point.1. must be fi"),
        (
            lambda: ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=-1),
            "PlaneBoundary: friction must be at least 0, got -1",
        ),
        (
            lambda: ps.PlaneBoundary((0, 0, 0), (0, 1, 0), restitution=2),
            "PlaneBoundary: restitution must be at most 1, got 2",
        ),
        (lambda: ps.BoxBoundary((0, 0, 0), (1, 0, 1)), "BoxBoundary: upper must be above lower"),
        (lambda: ps.BoxBoundary((0, 0, INF), (1, 1, INF)), "BoxBoundary: lower.2. must be finite"),
        (lambda: ps.BoxBoundary((0, 0, np.nan), (1, 1, 1)), "BoxBoundary: lower.2. must be finite"),
        (lambda: ps.BoxBoundary((0, 0), (1, 1)), "BoxBoundary: lower must have shape"),
        (lambda: ps.BoxBoundary("abc", (1, 1, 1)), "BoxBoundary: lower must be numbers"),
        (lambda: ps.SphereBoundary((0, 0, 0), 0.0), "SphereBoundary: radius must be above 0"),
        (lambda: ps.SphereBoundary((0, 0), 1.0), "SphereBoundary: center must have shape"),
    ],
)
def test_bad_arguments(make, message):
    """Each in the house form."""
    with pytest.raises(ValueError, match=message):
        make()


@pytest.mark.parametrize(
    ("boundary", "message"),
    [
        (ps.PlaneBoundary((0, 0, 0), (1, 1, 0)), "PlaneBoundary: normal must be along the open"),
        (ps.BoxBoundary((0, 0, 0), (1, 1, 1)), "BoxBoundary: sides along x must be open where"),
        (ps.SphereBoundary((0, 0, 0), 1.0), "SphereBoundary: scene must be open along all axes"),
    ],
)
def test_periodic_axes_have_no_sides(boundary, message, device, simulate):
    """A wall across a periodic axis would have two sides to be on."""
    scene = ps.Scene(periodic=((0, None, 0), (1, None, 1)))
    scene.add_particles([(0.5, 0.5, 0.5)])
    scene.add_constraint(boundary)
    with pytest.raises(ValueError, match=message):
        simulate(scene, device)
