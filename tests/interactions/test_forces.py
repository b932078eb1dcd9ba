"""Interactions: forces from energies, laws of every kind, springs, and what they refuse."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps


def simulate(scene, device, **knobs):
    return ps.Simulation(scene, ps.Settings(**knobs), device=device)


def force_of(scene, precision, device):
    sim = simulate(scene, device, precision=precision)
    sim.forces(0.0)
    return sim.get("force")


def cluster(count=40, seed=0, **attributes):
    """Particles about a distance of 1 apart, and their scene."""
    rng = np.random.default_rng(seed)
    side = int(np.ceil(count ** (1 / 3)))
    x = ps.sample.lattice("sc", (side,) * 3, 1.0)[:count] + rng.uniform(-0.1, 0.1, (count, 3))
    scene = ps.Scene()
    scene.add_particles(x, velocity=rng.normal(size=(count, 3)), **attributes)
    return scene


# Forces and energies ----------------------------------------------------------------------------


@ps.law
def lennard_jones(r: float, epsilon: float, sigma: float):
    s2 = sigma * sigma / (r * r)
    s6 = s2 * s2 * s2
    return 4.0 * epsilon * (s6 * s6 - s6)


def test_a_derived_force_equals_the_one_written_by_hand(precision, device):
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
    "mie": lambda: ps.LennardJones(cutoff=1.9, exponents=(50, 49), truncation="force_shift"),
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
def test_forces_are_minus_the_slope_of_the_energy(name, device):
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
def test_mie_has_its_well(exponents, device):
    # The minimum is -epsilon at (n/m)^(1/(n-m)) sigma, where the force vanishes.
    n, m = exponents
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (0.7 * (n / m) ** (1 / (n - m)), 0, 0)])
    scene.add_interaction(ps.LennardJones(epsilon=1.3, sigma=0.7, cutoff=5.0, exponents=exponents))
    sim = simulate(scene, device, precision="float64")
    sim.forces(0.0)
    # Powers up to 50 of a distance right to 1 eps, times the strength (136 for 50, 49).
    assert sim.diagnostics().potential[0] == pytest.approx(-1.3, rel=1e-11)
    assert np.abs(sim.get("force")).max() < 1e-10


def test_uniform_gravity_is_weight_and_height(precision, device):
    scene = ps.Scene()
    scene.add_particles([(0, 2, 0), (0, 3, 5)], mass=[1, 4])
    scene.add_interaction(ps.UniformGravity((0, -10, 0)))
    sim = simulate(scene, device, precision=precision)
    sim.forces(0.0)
    np.testing.assert_array_equal(sim.get("force"), [(0, -10, 0), (0, -40, 0)])
    assert sim.diagnostics().potential[0] == 20 + 120


def test_only_the_group_feels_it(precision, device):
    scene = cluster(8)
    few = scene.add_particles([(5, 0, 0), (6, 0, 0)], group="few")
    more = scene.add_particles([(5, 1, 0)], group="more")
    scene.add_interaction(ps.ConstantForce((0, 1, 0), few))
    scene.add_interaction(ps.ConstantForce((0, 0, 2), [few, more]))
    scene.add_interaction(ps.ConstantForce((3, 0, 0), [0, 2]))
    scene.add_interaction(ps.Gravity(few))
    expected = np.zeros((11, 3))
    expected[few.slice] = [(1, 1, 2), (-1, 1, 2)]
    expected[more.slice] = (0, 0, 2)
    expected[[0, 2], 0] = 3
    np.testing.assert_allclose(force_of(scene, precision, device), expected, atol=1e-6)


def test_parameters_override_quantities(precision, device):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (2, 0, 0)], charge=[1.0, 3.0])
    scene.add_interaction(ps.PairPotential(screened, cutoff=None, screening=1e6, charge_j=5.0))
    # u = q_i 5 exp(-r/s)/r: what i feels depends on its own charge; exp(-2e-6) is 1 - 2e-6.
    force = force_of(scene, precision, device)[:, 0]
    np.testing.assert_allclose(force, [-5 / 4, 15 / 4], rtol=1e-5)


def test_a_law_may_ask_for_the_cutoff(device):
    @ps.law
    def overlap(r: float, cutoff: float):
        return (cutoff - r) * (cutoff - r)

    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (0.5, 0, 0)])
    scene.add_interaction(ps.PairPotential(overlap, cutoff=0.8))
    sim = simulate(scene, device, precision="float64")
    assert sim.diagnostics().potential[0] == pytest.approx(0.09, rel=1e-14)


def test_time_in_a_law(precision, device):
    @ps.law
    def ramp(time: float, mass: float, jerk: wp.vec3):
        return mass * time * jerk

    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], mass=3.0)
    scene.add_interaction(ps.ParticleForce(ramp, jerk=(0, 6, 0)))
    for method, expected in (
        # v = sum of a(t_k) dt over t_k = 0, dt .. (n-1) dt; and by the trapezoidal rule, exactly.
        ("symplectic_euler", 6 * 0.01**2 * 100 * 99 / 2),
        ("velocity_verlet", 6 * 1.0 / 2),
    ):
        sim = simulate(scene, device, dt=0.1, substeps=10, precision=precision, integrator=method)
        for _ in range(10):
            sim.step()
        # 100 additions of rounded increments, compensated.
        assert sim.velocity[0, 1] == pytest.approx(expected, rel=1e-6)


def test_drag_takes_away_the_same_share_each_step(precision, device):
    # v -> v (1 - c dt/m) in every step of symplectic Euler: (1 - z)^n, near exp(-n z).
    c, m, n = 2.0, 0.5, 100
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], velocity=(3, 4, 0), mass=m)
    scene.add_interaction(ps.Drag(linear=c))
    sim = simulate(scene, device, dt=0.1, substeps=n, precision=precision)
    sim.step()
    z = c * 0.1 / n / m
    speed = np.linalg.norm(sim.velocity[0])
    # Each of n steps rounds the increment, z of the speed, by up to 4 eps; the speed by 2 more.
    eps = float(np.finfo(precision).eps)
    assert speed == pytest.approx(5 * (1 - z) ** n, rel=(4 * n * z + 2) * eps)
    # (1 - z)^n = exp(-n z - n z^2/2 - ...)
    assert speed == pytest.approx(5 * np.exp(-0.4), rel=n * z**2)


def test_quadratic_drag_is_against_the_flow(device):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], velocity=(3, 0, 5))
    scene.add_interaction(ps.Drag(linear=0.5, quadratic=2.0, flow=(0, 4, 5)))
    # u = (3, -4, 0), |u| = 5: f = -(0.5 + 10) u.
    np.testing.assert_allclose(force_of(scene, "float64", device)[0], [-31.5, 42, 0], rtol=1e-14)


# Coincident and isolated ------------------------------------------------------------------------


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
def test_coincident_particles_push_each_other_equally_and_opposite(name, precision, device):
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


def test_a_hard_core_at_no_distance_is_an_error_with_a_name(device):
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
def test_momentum_of_an_isolated_scene(name, precision, device):
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


# Springs ----------------------------------------------------------------------------------------


def test_springs_hold_energy_and_virial(device):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (3, 0, 0), (3, 4, 0)])
    scene.add_interaction(ps.Springs([(0, 1), (1, 2)], [2.0, 10.0], [1.0, 5.0]))
    measured = simulate(scene, device, precision="float64").diagnostics()
    assert measured.potential[0] == pytest.approx(0.5 * 2 * 2**2 + 0.5 * 10 * 1**2, rel=1e-14)
    # The sum of r.F over pairs: -k (r - L) r.
    assert measured.virial[0] == pytest.approx(-2 * 2 * 3 + 10 * 1 * 4, rel=1e-14)


def test_springs_are_at_rest_as_they_start(device):
    scene = cluster(20)
    scene.add_interaction(ps.Springs([(0, 1), (3, 17)], 100.0))
    assert np.abs(force_of(scene, "float64", device)).max() < 1e-12


def test_springs_across_a_periodic_boundary(precision, device):
    scene = ps.Scene(periodic=((0, None, None), (10, None, None)))
    scene.add_particles([(0.5, 0, 0), (9.0, 0, 0)])
    scene.add_interaction(ps.Springs([(0, 1)], 2.0))
    scene.add_interaction(ps.Springs([(0, 1)], 3.0, 1.0))
    # 1.5 apart by way of the boundary: the first is at rest, the second pulls by 3 (1.5 - 1).
    np.testing.assert_allclose(force_of(scene, precision, device)[:, 0], [-1.5, 1.5], rtol=1e-6)


def test_two_bodies_on_a_spring_swing_at_their_frequency(device):
    # omega = sqrt(k / mu); leapfrog swings at omega' with sin(omega' dt / 2) = omega dt / 2.
    m, k = (1.0, 3.0), 12.0
    omega = np.sqrt(k * (1 / m[0] + 1 / m[1]))
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1.1, 0, 0)], mass=m)
    scene.add_interaction(ps.Springs([(0, 1)], k, 1.0))
    dt = 0.01
    sim = simulate(
        scene, device, dt=dt, substeps=1, precision="float64", integrator="velocity_verlet"
    )
    phase = 2 / dt * np.arcsin(omega * dt / 2)
    for step in range(1, 301):
        sim.step()
        if step % 50 == 0:
            stretch = np.linalg.norm(sim.position[1] - sim.position[0]) - 1.0
            # Right to the round-off of 300 steps.
            assert stretch == pytest.approx(0.1 * np.cos(phase * step * dt), abs=1e-12)


def test_damping_acts_along_the_spring_only(device):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (2, 0, 0)], velocity=[(0, 0, 0), (3, 5, 7)])
    scene.add_interaction(ps.Springs([(0, 1)], 0.0, damping=0.5))
    np.testing.assert_allclose(
        force_of(scene, "float64", device), [(1.5, 0, 0), (-1.5, 0, 0)], rtol=1e-14
    )


# Bad input --------------------------------------------------------------------------------------


@ps.law
def bond(r: float, stiffness: float):
    return 0.5 * stiffness * r * r


@ps.law
def clash(r: float, cutoff_squared: float):
    return r * cutoff_squared


@ps.law
def nothing():
    return 1.0


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: ps.LennardJones(epsilon=-1.0), r"epsilon must be at least 0 \[energy\]"),
        (lambda: ps.LennardJones(sigma=0.0), r"sigma must be above 0 \[length\]"),
        (lambda: ps.LennardJones(sigma=np.nan), "sigma must be finite"),
        (lambda: ps.LennardJones(cutoff=np.inf), "cutoff must be finite"),
        (lambda: ps.LennardJones(exponents=12), "exponents must be two, got 12"),
        (lambda: ps.LennardJones(exponents=(6, 12)), "exponents must fall"),
        (lambda: ps.LennardJones(exponents=(12.5, 6)), "whole number"),
        (lambda: ps.LennardJones(truncation="shifted"), "did you mean 'shift'"),
        (lambda: ps.LennardJones(exponents=(9, 3)).tail(0.8), "exponents must be above 3"),
        (lambda: ps.Gravity(G=np.nan), "G must be finite"),
        (lambda: ps.Gravity(softening=-0.1), "softening must be at least 0"),
        (lambda: ps.UniformGravity(9.81), r"shape \(3,\)"),
        (lambda: ps.UniformGravity((0, np.nan, 0)), "finite"),
        (lambda: ps.ConstantForce((0, 1)), r"shape \(3,\)"),
        (lambda: ps.Drag(linear=-1.0), r"linear must be at least 0 \[mass/time\]"),
        (lambda: ps.Drag(flow=3.0), "flow"),
        (lambda: ps.Springs([(0, 0)], 1.0), r"pairs\[0\] must name different particles"),
        (lambda: ps.Springs([(0, 1, 2)], 1.0), r"shape \(m, 2\)"),
        (lambda: ps.Springs([(0, 1.5)], 1.0), "of indices"),
        (lambda: ps.Springs([(-1, 1)], 1.0), "from 0 up"),
        (lambda: ps.Springs([(0, 1)], -1.0), r"stiffness\[0\] must be at least 0"),
        (lambda: ps.Springs([(0, 1)], np.nan), r"stiffness\[0\] must be finite"),
        (lambda: ps.Springs([(0, 1)], [1, 2]), r"shape \(\) or \(1,\)"),
        (lambda: ps.Springs([(0, 1)], 1.0, -1.0), r"rest_length\[0\] must be at least 0"),
        (lambda: ps.PairPotential(bond, cutoff=-1.0, stiffness=1.0), "cutoff must be above 0"),
        (lambda: ps.PairPotential(bond, cutoff=1.0), "stiffness must be given, as bond"),
        (lambda: ps.PairPotential(bond, cutoff=1.0, stiffness="k"), "must be a number"),
        (lambda: ps.PairPotential(bond, cutoff=1.0, stiffness=np.nan), "must be finite"),
        (lambda: ps.PairPotential(clash, cutoff=1.0, cutoff_squared=1.0), "a name of its own"),
        (lambda: ps.PairPotential(nothing, cutoff=1.0), "take the distance r"),
    ],
)
def test_bad_parameters(make, says, refused):
    with refused(says):
        make()


@pytest.mark.parametrize(
    "make",
    [
        lambda: ps.PairPotential(bond, cutoff=1.0, stifness=1.0),
        lambda: ps.PairForce(bond, cutoff=1.0, stifness=1.0),
        lambda: ps.ParticleForce(bond, r=1.0, stifness=1.0),
    ],
)
def test_unknown_parameters(make, refused):
    with refused("got 'stifness'; did you mean 'stiffness'", kind=TypeError):
        make()


@pytest.mark.parametrize(
    ("group", "says"),
    [
        ("water", "groups or indices, got 'water'"),
        ([0.5], "groups or indices"),
        ([0, 99], "from 0 to 3, got 99"),
        ([-1], "from 0 to 3, got -1"),
        (np.array([True, False, True, True]), "groups or indices"),
    ],
)
def test_bad_groups(group, says, refused):
    scene = cluster(4)
    scene.add_interaction(ps.Gravity(group))
    with refused(f"Gravity: group must .*{says}"):
        ps.Simulation(scene, device="cpu")


def test_a_group_of_another_scene(refused):
    scene = cluster(4)
    scene.add_interaction(ps.Gravity(cluster(4).groups[0]))
    with refused("group must belong to the scene"):
        ps.Simulation(scene, device="cpu")


def test_an_attribute_that_is_not_there(refused):
    scene = cluster(4)
    scene.add_interaction(ps.PairPotential(screened, cutoff=1.0))
    with refused("charge must be given or be one of the particles' density, mass"):
        ps.Simulation(scene, device="cpu")


def test_springs_to_a_particle_that_is_not_there(refused):
    scene = cluster(4)
    scene.add_interaction(ps.Springs([(0, 4)], 1.0))
    with refused("pairs must hold indices from 0 to 3, got 4"):
        ps.Simulation(scene, device="cpu")


EMPTY = [
    lambda none: ps.LennardJones(none),
    lambda none: ps.Gravity(none),
    lambda none: ps.UniformGravity(group=none),
    lambda none: ps.Drag(1.0, group=none),
    lambda none: ps.Springs([], 1.0),
]


@pytest.mark.parametrize("make", EMPTY)
@pytest.mark.parametrize("count", [0, 1])
def test_nobody_to_act_on(make, count, device):
    scene = ps.Scene()
    scene.add_particles(np.zeros((count, 3)), velocity=(1, 0, 0))
    none = scene.add_particles([], group="none")
    scene.add_interaction(make(none))
    sim = simulate(scene, device, dt=0.1)
    sim.step()
    assert str(sim.explain())
    assert sim.diagnostics().potential[0] == 0
    np.testing.assert_allclose(sim.position, np.array([[0.1, 0, 0]] * count).reshape(-1, 3), 1e-6)
