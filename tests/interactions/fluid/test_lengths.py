"""Smoothing lengths of particles' own: sums, forces, lists that follow, worlds, restarts."""

import functools

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.worlds import equal_alone
from particlesim.engine.model import Model

ETA, GAMMA = 1.2, 5 / 3
VISCOSITY = ps.ArtificialViscosity(1.0, 2.0)
SIGMA = 21 / (16 * np.pi)
BOX = ((-2.0, -2.0, -2.0), (2.0, 2.0, 2.0))


def cloud(count, seed=1, periodic=None, viscosity=VISCOSITY, state=None, group=None, **options):
    """Gas that is some hundred times as dense in the middle as outside, and quick."""
    random = np.random.default_rng(seed)
    x = random.normal(0, 0.7, (count, 3))
    if periodic is not None:
        x = random.uniform(-2, 2, (count, 3)) * np.where(np.arange(count) % 2, 1, 0.3)[:, None]
    scene = ps.Scene(periodic=periodic)
    scene.add_particles(
        x, mass=random.uniform(0.5, 1.5, count) / count, velocity=random.normal(0, 0.5, (count, 3)),
        internal_energy=random.uniform(0.5, 1.5, count),
    )  # fmt: skip
    scene.add_interaction(
        ps.SPH(group, smoothing_length=ps.AdaptiveSmoothing(ETA, **options),
               equation_of_state=state or ps.IdealGas(GAMMA), viscosity=viscosity)
    )  # fmt: skip
    return scene


def simulate(scene, device="cpu", integrator="velocity_verlet", **knobs):
    settings = ps.Settings(
        **{"dt": 0.02, "substeps": 4, "precision": "float64", "integrator": integrator, **knobs}
    )
    return ps.Simulation(scene, settings, device=device)


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


def test_positions_that_are_written_have_lengths_that_fit():
    scene = cloud(300)
    sim = simulate(scene)
    before = sim.get("smoothing_length")
    sim.position = 2 * sim.position
    # To the tolerance of both.
    np.testing.assert_allclose(sim.get("smoothing_length"), 2 * before, rtol=1e-7)


def test_lengths_end_at_the_largest_and_a_run_says_so():
    """Particles by themselves keep it, and what they feel of each other derives from it."""
    scene = cloud(300, largest=0.5)
    sim = simulate(scene)
    h = sim.get("smoothing_length")
    assert 0.05 < (h == 0.5).mean() < 0.9 and h.max() == 0.5
    with pytest.warns(ps.StabilityWarning, match="largest must be above"):
        sim.run(1)
    before = sim.diagnostics()
    sim.run(5)
    assert sim.diagnostics().energy == pytest.approx(before.energy, rel=1e-12)


def test_refuses(refused):
    for options in ({"eta": 0.0}, {"eta": np.nan}, {"largest": -1.0}, {"largest": np.inf}):
        (name,) = options
        with refused(name):
            ps.AdaptiveSmoothing(**options)


@pytest.mark.slow
@pytest.mark.parametrize("count", [0, 1, 2, 5])
@pytest.mark.parametrize("dimension", [1, 2, 3])
def test_few_particles(count, dimension):
    x = np.random.default_rng(0).uniform(0, 1, (5, 3))[:count] * (np.arange(3) < dimension)
    scene = ps.Scene()
    scene.add_particles(x, internal_energy=1.0)
    scene.add_interaction(
        ps.SPH(smoothing_length=ps.AdaptiveSmoothing(), equation_of_state=ps.IdealGas(1.4),
               dimension=dimension)
    )  # fmt: skip
    sim = simulate(scene)
    sim.run(2)
    assert np.isfinite(sim.position).all() and np.isfinite(sim.get("density")).all()


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


@pytest.mark.slow
def test_two_gases_have_lengths_of_their_own():
    """As each alone, where they do not meet; from the start on, and from a start again."""
    scenes = [cloud(300), cloud(200, seed=3)]
    both = ps.Scene()
    groups = []
    for k, scene in enumerate(scenes):
        groups.append(
            both.add_particles(
                scene.position, mass=scene.mass, velocity=scene.velocity, group=f"gas {k}",
                internal_energy=scene.column("internal_energy"),
            )
        )  # fmt: skip
    for group, eta in zip(groups, (1.2, 1.5), strict=True):
        both.add_interaction(
            ps.SPH(group, smoothing_length=ps.AdaptiveSmoothing(eta), viscosity=VISCOSITY,
                   equation_of_state=ps.IdealGas(GAMMA))
        )  # fmt: skip
    sim = simulate(both)
    alone = simulate(scenes[0])
    for each in (sim, alone):
        each.run(4)
    assert np.array_equal(sim.position[:300], alone.position)
    end = sim.position
    sim.reset()
    sim.run(4)
    assert np.array_equal(sim.position, end)


@pytest.mark.slow
@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_units_do_not_matter(unit, precision):
    """Lengths in other units, and with them velocities and energies; from rest, as where velocities
    are random, particles that meet multiply what rounding differs by.
    """
    found = []
    for scale in (1.0, unit):
        plain = cloud(300)
        scene = ps.Scene()
        scene.add_particles(scale * plain.position, mass=plain.mass, internal_energy=scale**2)
        scene.add_interaction(plain.interactions[0])
        sim = simulate(scene, precision=precision)
        sim.run(2)
        found.append((sim.position / scale, sim.get("smoothing_length") / scale))
    # As both may be found to the tolerance, and moves are a few lengths in 8 substeps.
    rtol = {"float32": 1e-3, "float64": 1e-7}[precision]
    for ours, theirs in zip(*found, strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=rtol, atol=rtol)


@pytest.mark.slow
def test_laws_of_ones_own_name_the_internal_energy():
    """A stiffened gas, P = (gamma - 1) rho u - gamma P0, whose u is heated as any."""

    @ps.law
    def pressure(density: float, internal_energy: float, gamma: float, stiffness: float):
        return (gamma - 1.0) * density * internal_energy - gamma * stiffness

    @ps.law
    def energy(internal_energy: float):
        return internal_energy

    @ps.law
    def sound_speed(density: float, pressure: float, gamma: float, stiffness: float):
        return wp.sqrt(gamma * (pressure + stiffness) / density)

    class StiffenedGas(ps.EquationOfState):
        def __init__(self, gamma, stiffness):
            self.parameters = {"gamma": gamma, "stiffness": stiffness}

    StiffenedGas.pressure, StiffenedGas.energy = pressure, energy
    StiffenedGas.sound_speed = sound_speed
    sim = simulate(cloud(200, state=StiffenedGas(1.4, 1e-6)))
    before = sim.diagnostics().energy
    rho, u = sim.get("density"), sim.get("internal_energy")
    np.testing.assert_allclose(sim.get("pressure"), 0.4 * rho * u - 1.4e-6, rtol=1e-12)
    sim.run(3)
    assert sim.diagnostics().energy == pytest.approx(before, rel=1e-12)


@pytest.mark.slow
def test_a_surface_is_drawn():
    pytest.importorskip("pysplashsurf")
    sim = simulate(cloud(300))
    points, _triangles, _normals = ps.Surface(sim).mesh()
    assert len(points) > 10
