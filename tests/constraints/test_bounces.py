"""Bounces off boundaries: of single particles, and through bodies that they are part of."""

import itertools

import numpy as np
import pytest

import particlesim as ps

G = 9.81


@pytest.mark.parametrize("phase", [0.0, 0.25, 0.5, 0.75])
def test_friction_of_an_impact_does_not_know_the_phase(phase, device):
    """mu (1 + e) v_n, wherever in a substep the floor is met: 2 - 0.2 * 2 * 1."""
    scene = ps.Scene()
    scene.add_particles([(0, 0.1 + (30 + phase) / 600, 0)], velocity=(2, -1, 0), radius=0.1)
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=0.2, restitution=1.0))
    sim = ps.Simulation(scene, device=device)
    sim.run(12)
    assert sim.velocity[0] == pytest.approx((1.6, 1.0, 0.0), abs=1e-5)


def test_friction_of_an_impact_stops_what_it_can(device):
    """Where mu (1 + e) v_n is more than the way along the floor, that ends, and does not turn."""
    scene = ps.Scene()
    scene.add_particles([(0, 0.13, 0)], velocity=(0.5, -1, 0), radius=0.1)
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=0.9, restitution=0.5))
    sim = ps.Simulation(scene, device=device)
    sim.run(12)
    assert sim.velocity[0] == pytest.approx((0.0, 0.5, 0.0), abs=1e-5)


def test_a_boundary_feels_the_whole_impulse(device):
    """m (1 + e) v_n over the substep in which it is met."""
    scene = ps.Scene()
    scene.add_particles([(0, 0.1037, 0)], velocity=(0, -1, 0), radius=0.1, mass=3.0)
    floor = scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), restitution=0.5))
    sim = ps.Simulation(scene, ps.Settings(dt=0.005, substeps=1), device=device)
    sim.step()
    force = np.reshape(sim.force(floor), 3)
    assert force == pytest.approx((0, -3 * 1.5 / 0.005, 0), rel=1e-5)


ROD = np.array([(0, 0, 0), (0, 0.3, 0)])
CUBE = 0.1 * np.array(list(itertools.product(range(3), repeat=3)), float)
SHORT = [
    (i, j)
    for i, j in itertools.combinations(range(27), 2)
    if np.linalg.norm(CUBE[i] - CUBE[j]) < 0.18
]


def fallen(x, links, tilt, restitution, precision, device):
    """Heights, frame by frame, of the middle of a rigid body that falls by 1 m."""
    c, s = np.cos(tilt), np.sin(tilt)
    x = x @ np.array([(c, s, 0), (-s, c, 0), (0, 0, 1)])
    x[:, 1] += 1.05 - x[:, 1].min()
    scene = ps.Scene()
    scene.add_particles(x, radius=0.05)
    scene.add_interaction(ps.UniformGravity((0, -G, 0)))
    scene.add_constraint(ps.Distance(links))
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), restitution=restitution))
    settings = ps.Settings(dt=1 / 60, substeps=20, precision=precision)
    sim = ps.Simulation(scene, settings, device=device)
    heights = [sim.position[:, 1].mean()]
    for _ in range(58):
        sim.step()
        heights.append(sim.position[:, 1].mean())
    return np.array(heights)


@pytest.mark.parametrize("restitution", [1.0, 0.5])
@pytest.mark.parametrize("body", ["rod", "rod lying", "cube"])
def test_a_rigid_body_returns_to_e_squared(body, restitution, device):
    """Upright, lying, on a face: the center of mass rises by e^2 of the 1 m that it fell, within 3
    %: the impulse on what touches goes through the rods, until nothing is short of 1e-4 of it.
    """
    x, links = (CUBE, SHORT) if body == "cube" else (ROD, [(0, 1)])
    tilt = np.pi / 2 if body == "rod lying" else 0.0
    heights = fallen(x, links, tilt, restitution, "float64", device)
    rise = heights[30:].max() - (heights[0] - 1.0)
    assert rise == pytest.approx(restitution**2, rel=0.03)


@pytest.mark.parametrize("tilt", [0.3, 0.7])
def test_a_tilted_rod_keeps_its_energy(tilt, device):
    """At e = 1 an oblique impact turns height into spin and loses nothing: within 2 %.

    Newton's law at one contact of a rigid body: J = (1 + e) v_n m_eff, which takes no energy.
    """
    scene = ps.Scene()
    x = ROD @ np.array(
        [(np.cos(tilt), np.sin(tilt), 0), (-np.sin(tilt), np.cos(tilt), 0), (0, 0, 1)]
    )
    scene.add_particles(x + np.array([0, 0.5, 0]), radius=0.05, velocity=(0, -2, 0))
    scene.add_constraint(ps.Distance([(0, 1)]))
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), restitution=1.0))
    sim = ps.Simulation(scene, ps.Settings(dt=1 / 60, substeps=20), device=device)
    start = sim.diagnostics().kinetic
    sim.run(20)
    assert sim.velocity[:, 1].mean() > -1.5  # it has met the floor
    assert sim.diagnostics().kinetic == pytest.approx(start, rel=0.02)


def test_worlds_bounce_as_alone(device):
    """One that bounces and one that does not, in a batch and by themselves: the same bits."""

    def build(height):
        scene = ps.Scene()
        scene.add_particles(CUBE + np.array([0, height, 0]), radius=0.05, velocity=(0.3, -3, 0))
        scene.add_constraint(ps.Distance(SHORT))
        floor = ps.PlaneBoundary((0, 0, 0), (0, 1, 0), restitution=0.8, friction=0.3)
        scene.add_constraint(floor)
        return scene

    settings = ps.Settings(dt=1 / 60, substeps=5)
    batch = ps.Simulation([build(0.2), build(0.27), build(5.0)], settings, device=device)
    batch.run(12)
    for w, height in enumerate((0.2, 0.27, 5.0)):
        alone = ps.Simulation(build(height), settings, device=device)
        alone.run(12)
        assert (batch.world(w).position == alone.position).all()
        assert (batch.world(w).velocity == alone.velocity).all()


def test_a_rigid_cluster_bounces_as_one(device):
    """A block of one cluster, on a face and on an edge, keeps its energy at e = 1 within 2 %."""
    for tilt in (0.0, 0.4):
        c, s = np.cos(tilt), np.sin(tilt)
        x = (CUBE - 0.1) @ np.array([(c, s, 0), (-s, c, 0), (0, 0, 1)])
        x[:, 1] += 0.5 - x[:, 1].min()
        scene = ps.Scene()
        scene.add_particles(x, radius=0.05, velocity=(0, -2, 0))
        scene.add_constraint(ps.ShapeMatching([range(27)]))
        scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), restitution=1.0))
        sim = ps.Simulation(scene, ps.Settings(dt=1 / 60, substeps=20), device=device)
        start = sim.diagnostics().kinetic
        sim.run(25)
        assert sim.velocity[:, 1].mean() > -1.5
        assert sim.diagnostics().kinetic == pytest.approx(start, rel=0.02)


@pytest.mark.parametrize("restitution", [1.0, 0.5])
@pytest.mark.parametrize("kind", ["rods", "clusters"])
def test_rigid_bodies_bounce_off_each_other(kind, restitution, device):
    """One of mass 2 hits another in line: (1 - e) / 2 and (1 + e) / 2 of the velocity, within 1 %.

    Momentum is kept to round-off.
    """
    scene = ps.Scene()
    x = [(0, 0, 0), (0.3, 0, 0), (0.437, 0, 0), (0.737, 0, 0)]
    scene.add_particles(x, radius=0.05, velocity=[(2, 0, 0)] * 2 + [(0, 0, 0)] * 2)
    pairs = [(0, 1), (2, 3)]
    scene.add_constraint(ps.Distance(pairs) if kind == "rods" else ps.ShapeMatching(pairs))
    scene.add_constraint(ps.Contact(restitution=restitution, exclude=pairs))
    sim = ps.Simulation(scene, ps.Settings(dt=1 / 60, substeps=10), device=device)
    sim.run(6)
    expected = np.repeat([1 - restitution, 1 + restitution], 2)
    assert sim.velocity[:, 0] == pytest.approx(expected, abs=0.02)
    assert sim.velocity[:, 0].sum() == pytest.approx(4.0, rel=1e-6)
