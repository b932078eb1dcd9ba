"""Forces and energies of every kind: one from the other, coincident particles, momentum."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps


@ps.law
def lennard_jones(r: float, epsilon: float, sigma: float):
    s2 = sigma * sigma / (r * r)
    s6 = s2 * s2 * s2
    return 4.0 * epsilon * (s6 * s6 - s6)


def test_a_derived_force_equals_the_one_written_by_hand(precision, device, cluster, force_of):
    derived, written = cluster(100), cluster(100)
    derived.add_interaction(ps.PairPotential(lennard_jones, cutoff=2.5, epsilon=1.0, sigma=1.0))
    written.add_interaction(ps.LennardJones(epsilon=1.0, sigma=1.0, cutoff=2.5))
    f, g = force_of(derived, precision, device), force_of(written, precision, device)
    # Near a distance of 0.8 terms reach 48 / 0.8^13 = 900; each is right to 13 * 8 eps.
    allowed = 900 * 13 * 8 * np.finfo(precision).eps
    np.testing.assert_allclose(f, g, rtol=0, atol=allowed)


@ps.law
def trap(position: wp.vec3, mass: float, stiffness: float, centre: wp.vec3):
    return -mass * stiffness * (position - centre)


@ps.law
def trap_energy(position: wp.vec3, mass: float, stiffness: float, centre: wp.vec3):
    d = position - centre
    return 0.5 * mass * stiffness * wp.dot(d, d)


@ps.law
def screened(r: float, charge_i: float, charge_j: float, screening: float = 0.7):
    return charge_i * charge_j * wp.exp(-r / screening) / r


SMOOTH = {
    "lennard_jones": lambda: ps.LennardJones(cutoff=1.9, truncation="force_shift"),
    "mie": lambda: ps.Mie(cutoff=1.9, exponents=(50, 49), truncation="force_shift"),
    "derived": lambda: ps.PairPotential(screened, cutoff=None),
    "gravity": lambda: ps.Gravity(G=2.0, softening=0.3),
    "springs": lambda: ps.Springs([(0, 1), (1, 2), (2, 5), (0, 9)], [1.0, 2.0, 3.0, 4.0], 0.7),
    "uniform_gravity": lambda: ps.UniformGravity((1, -9.81, 2)),
    "constant_force": lambda: ps.ConstantForce((1, 2, -3)),
    "particle_force": lambda: ps.ParticleForce(
        trap, potential=trap_energy, stiffness=2.0, centre=(0.5, 0.1, 0)
    ),
}


@pytest.mark.parametrize("name", SMOOTH)
def test_forces_are_minus_the_slope_of_the_energy(name, device, cluster, simulate):
    scene = cluster(12, mass=np.arange(1, 13), charge=np.linspace(-1, 1, 12))
    scene.add_interaction(SMOOTH[name]())
    sim = simulate(scene, device, precision="float64")
    sim.forces(0.0)
    force, x = sim.get("force"), sim.position
    # Central differences are right to h^2 u'''/6, with u''' = (n + 1)(n + 2) F / r^2 of a force
    # r^-(n+1) at r = 0.8, and to the round-off of the energy over 2 h.
    h, n = 1e-5, 50 if name == "mie" else 12
    third = (n + 1) * (n + 2) * np.abs(force).max() / 0.8**2
    energy = abs(sim.diagnostics().potential[0])
    allowed = h**2 / 6 * third + 12 * energy * np.finfo(float).eps / h
    for i, a in [(0, 0), (1, 1), (2, 2), (5, 0), (9, 1)]:
        energy = []
        for step in (-h, h):
            moved = x.copy()
            moved[i, a] += step
            sim.position = moved
            energy.append(sim.diagnostics().potential[0])
        slope = (energy[1] - energy[0]) / (2 * h)
        assert force[i, a] == pytest.approx(-slope, rel=0, abs=allowed)
    assert np.abs(force).max() > 0.1


@pytest.mark.parametrize("exponents", [(12, 6), (9, 6), (50, 49), (8, 1), (7, 3)])
def test_mie_has_its_well(exponents, device, simulate):
    # The minimum is -epsilon at (n/m)^(1/(n-m)) sigma, where the force vanishes.
    n, m = exponents
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (0.7 * (n / m) ** (1 / (n - m)), 0, 0)])
    scene.add_interaction(ps.Mie(epsilon=1.3, sigma=0.7, cutoff=5.0, exponents=exponents))
    sim = simulate(scene, device, precision="float64")
    sim.forces(0.0)
    # Powers up to 50 of a distance right to 1 eps, times the strength (136 for 50, 49).
    assert sim.diagnostics().potential[0] == pytest.approx(-1.3, rel=1e-11)
    assert np.abs(sim.get("force")).max() < 1e-10


def test_parameters_override_quantities(precision, device, force_of):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (2, 0, 0)], charge=[1.0, 3.0])
    scene.add_interaction(ps.PairForce(screened, cutoff=None, screening=1e6, charge_j=5.0))
    # F = q_i 5 exp(-r/s)/r: what i feels depends on its own charge; exp(-2e-6) is 1 - 2e-6.
    force = force_of(scene, precision, device)[:, 0]
    np.testing.assert_allclose(force, [-5 / 2, 15 / 2], rtol=1e-5)


def test_a_law_may_ask_for_the_cutoff(device, simulate):
    @ps.law
    def overlap(r: float, cutoff: float):
        return (cutoff - r) * (cutoff - r)

    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (0.5, 0, 0)])
    scene.add_interaction(ps.PairPotential(overlap, cutoff=0.8))
    sim = simulate(scene, device, precision="float64")
    assert sim.diagnostics().potential[0] == pytest.approx(0.09, rel=1e-14)


# Coincident and isolated --------------------------------------------------------------------------


@ps.law
def soft(r: float, reach: float):
    return 50.0 * (reach - r) * (reach - r)


COINCIDENT = {
    "rows": lambda pairs: ps.PairPotential(soft, cutoff=1.0, reach=1.0),
    "all_pairs": lambda pairs: ps.PairPotential(soft, cutoff=None, reach=1.0),
    "softened_gravity": lambda pairs: ps.Gravity(softening=0.1),
    "springs": lambda pairs: ps.Springs(pairs, 1.0, 0.5),
}


@pytest.mark.parametrize("name", COINCIDENT)
def test_coincident_particles_push_each_other_equally_and_opposite(
    name, precision, device, force_of, simulate
):
    scene = ps.Scene()
    x = np.repeat([[1.0, 2.0, 3.0], [-7.0, 0.5, 0.25]], 2, axis=0)
    scene.add_particles(x)
    scene.add_interaction(COINCIDENT[name]([(0, 1), (2, 3)]))
    force = force_of(scene, precision, device)
    assert np.isfinite(force).all()
    # All pairs pull at the others as well, whose sums may be rounded.
    allowed = 4 * np.finfo(precision).eps * np.abs(force).max()
    np.testing.assert_allclose(force[0::2].sum(axis=0), -force[1::2].sum(axis=0), atol=allowed)
    np.testing.assert_array_equal(force, force_of(scene, precision, device))
    if name != "softened_gravity":  # which vanishes with the distance
        # They part, rather than stay stuck together.
        assert np.linalg.norm(force[0] - force[1]) > 0.1
        sim = simulate(scene, device, dt=0.1, substeps=20, precision=precision)
        sim.step()
        assert np.linalg.norm(sim.position[0] - sim.position[1]) > 1e-3


def test_a_hard_core_at_no_distance_is_an_error_with_a_name(device, simulate):
    scene = ps.Scene()
    scene.add_particles([(9, 9, 9), (0, 0, 0), (0, 0, 0)])
    scene.add_interaction(ps.LennardJones())
    sim = simulate(scene, device)
    with pytest.raises(ps.SimulationError, match="of particle 1 in world 0 between t = 0"):
        sim.step()
    np.testing.assert_array_equal(sim.position, scene.position)


ISOLATED = {
    "lennard_jones": lambda: ps.LennardJones(cutoff=2.5),
    "gravity": lambda: ps.Gravity(softening=0.2),
    "derived": lambda: ps.PairPotential(screened, cutoff=None),
    "springs": lambda: ps.Springs([(k, k + 1) for k in range(99)], 50.0, damping=0.5),
}


@pytest.mark.parametrize("name", ISOLATED)
def test_momentum_of_an_isolated_scene(name, precision, device, cluster, simulate):
    scene = cluster(100, mass=np.random.default_rng(1).uniform(0.5, 2, 100), charge=0.5)
    scene.add_interaction(ISOLATED[name]())
    sim = simulate(scene, device, dt=0.02, substeps=10, precision=precision)
    before = sim.diagnostics()
    impulse = 0.0
    for _ in range(10):
        sim.step()
        impulse += np.abs(sim.get("force")).sum() * 0.02
    after = sim.diagnostics()
    # Each force is a sum of up to 99 terms right to an eps each, and its kick is rounded: the
    # net of all errors is below 100 eps of the impulse that was exchanged, and of the momenta.
    eps = np.finfo(precision).eps
    scale = impulse + np.abs(scene.mass[:, None] * scene.velocity).sum()
    assert np.abs(after.momentum - before.momentum).max() < 100 * eps * scale
    assert np.abs(sim.velocity - scene.velocity).max() > 0.01
    # Central forces keep the angular momentum too, up to the rounding of positions about 5 away.
    drift = np.abs(after.angular_momentum - before.angular_momentum).max()
    assert drift < 5 * 100 * eps * scale


@pytest.mark.parametrize("kind", [ps.PairForce, ps.PairPotential])
def test_virial_is_the_sum_of_r_f(kind, precision, device, cluster):
    """Of a force alone too: sum over pairs of x_ij . f_ij = sum over particles of x . f."""

    @ps.law
    def push(r: float):
        return 1.5 * (1.2 - r)

    scene = cluster(12)
    scene.add_interaction(kind(push, cutoff=1.2))
    sim = ps.Simulation(scene, ps.Settings(precision=precision), device=device)
    sim.forces(0.1)
    expected = (sim.get("position").astype(float) * sim.get("force").astype(float)).sum()
    rounding = 100 * np.finfo(precision).eps * np.abs(sim.get("force")).max() * 12
    assert abs(sim.diagnostics().virial[0] - expected) < rounding
