"""Smoothing lengths of particles' own: worlds, restarts, units, bounds, and what reads them."""

import functools

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.gas import GAMMA, SIGMA, VISCOSITY, cloud, simulate
from cases.worlds import equal_alone


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
