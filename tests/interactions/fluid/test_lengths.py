"""Smoothing lengths of particles' own: sums, forces, lists that follow, what is conserved."""

import numpy as np
import pytest

import particlesim as ps
from cases.gas import BOX, ETA, GAMMA, SIGMA, cloud, simulate
from particlesim.engine.model import Model


def reference(scene, sim):
    """Of all pairs, at the present state: eta, densities, accelerations and heating."""
    m, h = scene.mass, sim.state.smoothing_length.numpy().astype(float)
    x, v, u = (sim.get(name).astype(float) for name in ("position", "velocity", "internal_energy"))
    x_ij, v_ij = x[:, None] - x, v[:, None] - v
    if scene.periodic:
        x_ij -= 4.0 * np.round(x_ij / 4.0)
    r = np.linalg.norm(x_ij, axis=-1)
    q = r / h[:, None]
    s = np.maximum(1 - q / 2, 0)
    w, slope = s**4 * (1 + 2 * q), -5 * s**3
    sums = (m * w).sum(axis=1)
    rho = SIGMA / h**3 * sums
    omega = -(m * q * q * slope).sum(axis=1) / (3 * sums)
    omega[sim.interactions[0].lengths.at_bound()] = 1.0  # lengths that do not follow
    c, approach = np.sqrt(GAMMA * (GAMMA - 1) * u), (v_ij * x_ij).sum(axis=-1)
    mean = lambda a: (a[:, None] + a) / 2  # noqa: E731
    mu = mean(h) * np.minimum(approach, 0) / (r**2 + 0.01 * mean(h) ** 2)
    viscous = (2 * mu - mean(c)) * mu / mean(rho)
    stress = (GAMMA - 1) * u / (omega * rho)
    g = SIGMA / h[:, None] ** 5 * slope
    pull = (stress[:, None] + viscous / 2) * g
    a = -((m * (pull + pull.T))[:, :, None] * x_ij).sum(axis=1)
    heat = (m * (stress[:, None] * g + viscous / 4 * (g + g.T)) * approach).sum(axis=1)
    return (h**3 * rho / m) ** (1 / 3), rho, a, heat


def check(scene, sim):
    """Sums of the simulation, whose forces were taken at its present state, and all pairs'."""
    precision = sim.model.precision.name
    eta, rho, a, heat = reference(scene, sim)
    # ln h is found to the tolerance in a Newton step, and twice that where Omega is far off 1.
    tolerance, eps = {"float32": 1e-5, "float64": 1e-9}[precision], np.finfo(precision).eps
    free = ~sim.interactions[0].lengths.at_bound()
    assert free.mean() > 0.98
    np.testing.assert_allclose(eta[free], ETA, rtol=10 * tolerance + 100 * eps)
    np.testing.assert_allclose(sim.get("density"), rho, rtol=100 * eps)
    size = np.abs(a).max()
    np.testing.assert_allclose(sim.get("force") / scene.mass[:, None], a, atol=60 * 16 * eps * size)
    return heat


@pytest.mark.parametrize("precision", ["float64", pytest.param("float32", marks=pytest.mark.slow)])
@pytest.mark.parametrize("periodic", [None, pytest.param(BOX, marks=pytest.mark.slow)])
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


@pytest.mark.slow
def test_coincident_particles_part():
    x = np.repeat(np.random.default_rng(0).uniform(0, 1, (40, 3)), 2, axis=0)
    scene = ps.Scene()
    scene.add_particles(x, mass=1 / 80, internal_energy=1.0)
    scene.add_interaction(
        ps.SPH(smoothing_length=ps.AdaptiveSmoothing(), equation_of_state=ps.IdealGas(1.4))
    )
    sim = simulate(scene, watchdog=False)
    before = sim.diagnostics()
    sim.run(5)
    apart = np.linalg.norm(sim.position[::2] - sim.position[1::2], axis=1)
    assert (apart > 1e-5).all()  # from 0; what is near each other hardly feels it
    assert sim.diagnostics().energy == pytest.approx(before.energy, rel=1e-12)
    assert np.abs(sim.diagnostics().momentum).max() < 1e-12
