"""Smoothing lengths of particles' own: sums, forces, lists that follow, worlds, restarts."""

import functools

import numpy as np
import pytest

import particlesim as ps
from cases.gas import BOX, SIGMA, check, cloud, simulate
from cases.worlds import equal_alone
from particlesim.engine.model import Model


@pytest.mark.parametrize("precision", ["float64", pytest.param("float32", marks=pytest.mark.slow)])
@pytest.mark.parametrize("periodic", [None, pytest.param(BOX, marks=pytest.mark.slow)])
@pytest.mark.slow
def test_sums_are_those_of_all_pairs_wherever_particles_go(precision, periodic):
    """At the start, and when they have moved by several lengths, so that lists had to follow."""
    scene = cloud(700, periodic=periodic)
    sim = simulate(scene, precision=precision, watchdog=False)
    start = sim.get("smoothing_length")
    check(scene, sim)
    sim.run(10)
    sim.forces(0.0)
    moved = sim.get("smoothing_length") / start
    assert moved.max() > 1.5 and moved.min() < 0.9
    check(scene, sim)


@pytest.mark.slow
@pytest.mark.parametrize("count", [60, 3000])
def test_plain_rows_find_the_same(count, monkeypatch):
    """As CUDA makes them: directly, and by a grid."""
    monkeypatch.setattr(Model, "vectorised", False)
    monkeypatch.setattr("particlesim.engine.neighbors.verlet.SMALL", 1000)
    scene = cloud(count)
    sim = simulate(scene)
    check(scene, sim)
    sim.run(3)
    sim.forces(0.0)
    check(scene, sim)


def test_heats_by_the_sum_over_all_pairs():
    scene = cloud(300)
    sim = simulate(scene, substeps=1, dt=1e-8)
    expected = check(scene, sim)
    sim.step()
    rate = sim.interactions[0].heat.rates[0].numpy()
    # Half a kick is dt a / 2: 1e-8 of some hundred, of velocities of about 1.
    np.testing.assert_allclose(rate, expected, atol=1e-5 * np.abs(expected).max())


@pytest.mark.parametrize(
    "integrator", ["velocity_verlet", pytest.param("symplectic_euler", marks=pytest.mark.slow)]
)
def test_conserves_at_any_step(integrator):
    """Kinetic and internal energy are one sum; momentum and angular momentum stay."""
    scene = cloud(300)
    sim = simulate(scene, integrator=integrator)
    before = sim.diagnostics()
    sim.run(10)
    after = sim.diagnostics()
    assert np.abs(sim.velocity - scene.velocity).max() > 1.0
    # 40 substeps, which round sums of 60 terms; and the largest of what the sums are made of.
    assert after.energy == pytest.approx(before.energy, rel=40 * 60 * 2.2e-16)
    scale = (scene.mass * np.linalg.norm(sim.velocity, axis=1)).sum()
    atol = 40 * 60 * 2.2e-16 * scale
    np.testing.assert_allclose(after.momentum, before.momentum, atol=atol)
    far = np.linalg.norm(sim.position, axis=1).max()
    np.testing.assert_allclose(after.angular_momentum, before.angular_momentum, atol=atol * far)


@pytest.mark.slow
def test_force_is_the_gradient_of_the_energy():
    """Also as lengths change: what Omega is for."""
    scene = cloud(200, viscosity=None, state=ps.Polytrope(1.0, 1.5))
    sim = simulate(scene)
    force, x, step = sim.get("force"), sim.position.copy(), 1e-4
    for particle, axis in [(0, 0), (50, 1), (120, 2)]:
        energies = []
        for side in (step, -step):
            moved = x.copy()
            moved[particle, axis] += side
            sim.position = moved
            energies.append(sim.diagnostics().potential[0])
        derived = -(energies[0] - energies[1]) / (2 * step)
        # h is found to 1e-9, and the energy of 1 with it; step^2 / 6 (7 / h)^2 is 1e-6 of f.
        assert force[particle, axis] == pytest.approx(
            derived, abs=1e-9 / step + 1e-5 * np.abs(force).max()
        )


@pytest.mark.slow
def test_a_star_keeps_its_energy_by_the_order_of_the_method():
    drifts = []
    for substeps in (2, 4, 8):
        scene = cloud(200, viscosity=None, state=ps.Polytrope(1.0, 1.5))
        sim = simulate(scene, dt=0.05, substeps=substeps)
        before = sim.diagnostics().energy[0]
        sim.run(4)
        drifts.append(abs(sim.diagnostics().energy[0] - before))
    slopes = np.log2(np.array(drifts[:-1]) / drifts[1:])
    assert slopes[-1] == pytest.approx(2.0, abs=0.3)


def test_worlds_go_as_alone_and_go_on(tmp_path):
    scenes = [cloud(600), cloud(60, seed=3)]
    together = equal_alone(simulate, scenes, "cpu", 3)
    together.save(tmp_path / "gas.npz")
    loaded = ps.Simulation.load(tmp_path / "gas.npz", scenes, device="cpu")
    looked = simulate(scenes)
    fluid = scenes[0].interactions[0]
    for _ in range(6):
        looked.run(1)
        looked.diagnostics()
        looked.interpolate(fluid, [(0.1, 0, 0)], "density")
    for sim in (together, loaded):
        sim.run(3)
    for name in ("position", "velocity", "internal_energy", "smoothing_length"):
        assert np.array_equal(together.get(name), loaded.get(name))
        assert np.array_equal(together.get(name), looked.get(name))
    end = together.get("smoothing_length")
    together.reset([0])
    together.run(6)
    assert np.array_equal(together.get("smoothing_length")[:600], end[:600])


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["velocity_verlet", "symplectic_euler"])
@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_bits_of_every_way(integrator, precision, tmp_path):
    run = functools.partial(simulate, integrator=integrator, precision=precision, watchdog=False)
    scenes = [cloud(900), cloud(400, seed=3)]
    together = equal_alone(run, scenes, "cpu", 6)
    together.save(tmp_path / "gas.npz")
    loaded = ps.Simulation.load(tmp_path / "gas.npz", scenes, device="cpu")
    for sim in (together, loaded):
        sim.run(4)
    assert np.array_equal(together.position, loaded.position)
    other = together.world(1).position
    for sim in (together, loaded):
        if sim is together:
            # What is written in one world is nothing to another.
            sim.world(0).position = 0.9 * sim.world(0).position
        sim.run(2)
    assert np.array_equal(together.world(1).position, loaded.world(1).position)
    assert not np.array_equal(together.world(1).position, other)
    found = []
    for execution, threads in [("graph", 1), ("threads", 1), ("threads", 2)]:
        sim = run(cloud(3000), execution=execution, threads=threads)
        sim.run(5)
        found.append(np.concatenate([sim.position, sim.velocity]))
    assert np.array_equal(found[0], found[1]) and np.array_equal(found[0], found[2])


def test_interpolates_with_the_length_of_each():
    scene = cloud(300)
    sim, fluid = simulate(scene), scene.interactions[0]
    at = np.array([[0.1, 0.2, 0.0], [1.0, -0.5, 0.3], [50.0, 0.0, 0.0]])
    h = sim.get("smoothing_length")
    q = np.linalg.norm(at[:, None] - sim.position, axis=-1) / h
    w = SIGMA / h**3 * np.maximum(1 - q / 2, 0) ** 4 * (1 + 2 * q)
    expected = (scene.mass * w).sum(axis=1)
    found = sim.interpolate(fluid, at, "density")
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-14)
    assert found[2] == 0
