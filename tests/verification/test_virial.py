"""The virial of constraints and contacts: closed forms of mechanics."""

import numpy as np
import pytest

import particlesim as ps

SETTINGS = ps.Settings(dt=0.01, substeps=20, precision="float64")


def test_a_rod_that_turns(device):
    """Twice the kinetic energy is held together by the rod: 2 K + W = 0 of a circular motion."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1, 0, 0)], velocity=[(0, -1, 0), (0, 2, 0)], mass=[2.0, 1.0])
    scene.add_constraint(ps.Distance([(0, 1)]))
    sim = ps.Simulation(scene, SETTINGS, device=device)
    assert sim.diagnostics().virial[0] == 0  # no substep yet
    sim.run(3)
    found = sim.diagnostics()
    # Chords for arcs, omega = 3: C, the arm and the speed are off by (omega h)^2 / 2 at the most.
    turn = (3 * SETTINGS.dt / SETTINGS.substeps) ** 2
    assert found.virial[0] == pytest.approx(-2 * found.kinetic[0], rel=1.5 * turn)


def test_a_chain_that_hangs(device):
    """Link k of length d carries what hangs below it: W = -d sum of the weights."""
    count, length, weight = 6, 0.5, 2.0 * 10.0
    scene = ps.Scene()
    y = -length * np.arange(count + 1)
    scene.add_particles(
        np.stack([0 * y, y, 0 * y], axis=1), mass=2.0, pinned=np.arange(count + 1) == 0
    )
    scene.add_interaction(ps.UniformGravity((0, -10, 0)))
    scene.add_constraint(ps.Distance([(k, k + 1) for k in range(count)]))
    sim = ps.Simulation(scene, SETTINGS.replace(iterations=400), device=device)
    sim.run(2)
    known = -length * weight * sum(range(1, count + 1))
    assert sim.diagnostics().virial[0] == pytest.approx(known, rel=1e-6)


def test_a_constraint_and_its_force_have_the_same(device):
    """Of a soft spring at rest under a load, as a constraint and as a force."""
    found = []
    for as_force in (False, True):
        scene = ps.Scene()
        scene.add_particles([(0, 0, 0), (0, -1.2, 0)], mass=1.0, pinned=[True, False])
        scene.add_interaction(ps.UniformGravity((0, -10, 0)))
        spring = ps.Distance([(0, 1)], 1.0, compliance=0.02)
        scene.add_interaction(spring.as_force()) if as_force else scene.add_constraint(spring)
        sim = ps.Simulation(scene, SETTINGS, device=device)
        sim.run(1)
        found.append(sim.diagnostics().virial[0])
    assert found == pytest.approx([-1.2 * 10] * 2, rel=1e-9)


def test_a_column_that_rests(device):
    """Contact k carries what stands above it, at a distance of 2 R: W = 2 R times the weights."""
    count, radius, mass = 5, 0.1, 3.0
    scene = ps.Scene()
    y = radius * (1 + 2 * np.arange(count))
    scene.add_particles(np.stack([0 * y, y, 0 * y], axis=1), mass=mass, radius=radius)
    scene.add_interaction(ps.UniformGravity((0, -10, 0)))
    scene.add_constraint(ps.Contact())
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0)))
    sim = ps.Simulation(scene, SETTINGS.replace(iterations=300), device=device)
    sim.run(30)
    known = 2 * radius * mass * 10 * sum(range(1, count))
    # The rest: overlaps of layers times g h^2 shorten the distances, 1e-6 of them; the sweeps.
    assert sim.diagnostics().virial[0] == pytest.approx(known, rel=1e-3)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_two_that_collide(restitution, device):
    """Over a collision the virial adds up to the impulse (1 + e) m v times the distance 2 R."""
    radius, speed, mass = 0.1, 1.0, 2.0
    scene = ps.Scene(periodic=((0, 0, 0), (4, 4, 4)))  # across a face
    scene.add_particles(
        [(3.88, 2, 2), (0.11, 2, 2)], velocity=[(speed, 0, 0), (-speed, 0, 0)], mass=mass,
        radius=radius,
    )  # fmt: skip
    scene.add_constraint(ps.Contact(restitution=restitution))
    h = 1e-3
    sim = ps.Simulation(scene, SETTINGS.replace(dt=h, substeps=1), device=device)
    total = 0.0
    for _ in range(60):
        sim.step()
        total += h * sim.diagnostics().virial[0]
    known = (1 + restitution) * mass * speed * 2 * radius
    # They meet at most 2 v h deep.
    assert total == pytest.approx(known, rel=2 * speed * h / (2 * radius))


def test_contacts_of_a_world_that_is_reset(device):
    """The world that is at its start again has had no substep; the other keeps its last."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (0.19, 0, 0)], velocity=[(1, 0, 0), (-1, 0, 0)], radius=0.1)
    scene.add_constraint(ps.Contact())
    sim = ps.Simulation(scene, SETTINGS.replace(substeps=1, dt=1e-3), device=device, worlds=2)
    sim.step()
    virial = sim.diagnostics().virial
    assert (virial > 0).all()
    sim.reset([1])
    np.testing.assert_array_equal(sim.diagnostics().virial, [virial[0], 0])


def test_worlds_and_checkpoints(device, tmp_path):
    """Each world has its own, which a checkpoint keeps and a reset forgets."""
    scenes = []
    for speed in (1.0, 2.0):
        scene = ps.Scene()
        scene.add_particles([(0, 0, 0), (1, 0, 0)], velocity=[(0, -speed, 0), (0, speed, 0)])
        scene.add_constraint(ps.Distance([(0, 1)]))
        scenes.append(scene)
    sim = ps.Simulation(scenes, SETTINGS, device=device)
    sim.run(2)
    virial = sim.diagnostics().virial
    assert virial[1] == pytest.approx(4 * virial[0], rel=1e-3)
    sim.save(tmp_path / "rods.npz")
    loaded = ps.Simulation.load(tmp_path / "rods.npz", scenes, device=device)
    np.testing.assert_array_equal(loaded.diagnostics().virial, virial)
    sim.reset([1])
    np.testing.assert_array_equal(sim.diagnostics().virial, [virial[0], 0])
