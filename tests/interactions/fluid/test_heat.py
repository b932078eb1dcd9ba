"""Internal energies that go on in time: sums, first law, orders, worlds, restarts."""

import functools
import itertools

import numpy as np
import pytest

import particlesim as ps
from cases.worlds import equal_alone

GAMMA, H = 1.4, 0.7
VISCOSITY = ps.ArtificialViscosity(1.0, 2.0)
METHODS = ("symplectic_euler", "velocity_verlet")
# Kernels of one kind are enough for every run, and more of them for the long one.
LONG = pytest.mark.slow
SHORT_OR_LONG = [METHODS[0], pytest.param(METHODS[1], marks=LONG)]


@pytest.fixture
def gas(cloud):
    """A cloud of gas that is quick, hot and viscous, in a scene of its own."""

    def build(count=60, seed=0, dense=0.5, viscosity=VISCOSITY, **options):
        x, v, m = cloud(count, seed)
        u = np.random.default_rng(seed + 1).uniform(1, 3, count)
        scene = ps.Scene()
        scene.add_particles(dense * x, velocity=v, mass=m, internal_energy=u, **options)
        scene.add_interaction(
            ps.SPH(smoothing_length=H, equation_of_state=ps.IdealGas(GAMMA), viscosity=viscosity)
        )
        return scene

    return build


def simulate(scene, device="cpu", integrator="symplectic_euler", dt=0.01, **knobs):
    settings = ps.Settings(
        dt=dt, integrator=integrator, **{"substeps": 2, "precision": "float64", **knobs}
    )
    return ps.Simulation(scene, settings, device=device)


def reference_rates(x, v, m, u):
    """du/dt by the formula, with the smoothing function of Wendland in three dimensions."""
    x_ij, v_ij = x[:, None] - x, v[:, None] - v
    q = np.linalg.norm(x_ij, axis=-1) / H
    sigma, s = 21 / (16 * np.pi) / H**3, np.maximum(1 - q / 2, 0)
    rho = (m * sigma * s**4 * (1 + 2 * q)).sum(axis=1)
    c = np.sqrt(GAMMA * (GAMMA - 1) * u)
    approach = (v_ij * x_ij).sum(axis=-1)
    mu = H * np.minimum(approach, 0) / ((q * H) ** 2 + 0.01 * H**2)
    mean = lambda a: (a[:, None] + a) / 2  # noqa: E731
    viscous = (2 * mu - mean(c)) * mu / mean(rho)
    stress = ((GAMMA - 1) * u / rho)[:, None] + viscous / 2
    return (m * stress * sigma / H**2 * -5 * s**3 * approach).sum(axis=1)


@pytest.mark.parametrize("precision", [pytest.param("float32", marks=LONG), "float64"])
def test_heats_by_the_sum_of_the_paper(gas, precision):
    scene, dt = gas(), 1e-6
    sim = simulate(scene, precision=precision, dt=dt, substeps=1)
    u = scene.column("internal_energy")
    expected = reference_rates(scene.position, scene.velocity, scene.mass, u)
    sim.step()
    sim.forces(dt)
    rate = sim.interactions[0].heat.rates[0].numpy()
    # The mean velocity is a dt / 2 off, less than 1e-3 of 1. Sums of some 60 terms round.
    eps = np.finfo(precision).eps
    scale = np.abs(expected).max()
    np.testing.assert_allclose(rate, expected, atol=(1e-4 + 60 * 16 * eps) * scale)


@pytest.mark.parametrize("integrator", SHORT_OR_LONG)
def test_first_law_at_any_step(gas, integrator):
    """Kinetic and internal energy are one sum, to round-off, also where the step is far too long
    for the motion to be right.
    """
    sim = simulate(gas(), integrator=integrator, ledger=True)
    before = sim.diagnostics()
    sim.run(20)
    after = sim.diagnostics()
    assert abs(after.kinetic - before.kinetic) > 0.1 * before.kinetic
    # 40 substeps of 60 particles, each of which rounds sums of as many terms.
    assert after.energy == pytest.approx(before.energy, rel=40 * 60 * 2.2e-16)
    # What the fluid's work makes of the motion is what the heat loses.
    work = sim.ledger()["SPH"].work
    assert work == pytest.approx(before.potential - after.potential, rel=1e-10)
    momentum = np.abs(after.momentum - before.momentum).max()
    assert momentum < 1e-12 * np.abs(sim.velocity).max()


@pytest.mark.slow
@pytest.mark.parametrize("integrator", METHODS)
def test_order_of_the_internal_energy(gas, integrator):
    """Errors of u at a time fall with the order of the method.

    Without viscosity, whose law has a kink where pairs begin to approach.
    """
    ends = []
    for substeps in (8, 16, 32):
        sim = simulate(gas(viscosity=None), integrator=integrator, dt=0.04, substeps=substeps)
        sim.run(1)
        ends.append(sim.get("internal_energy"))
    coarse, fine = (np.linalg.norm(a - b) for a, b in itertools.pairwise(ends))
    # The next order's term changes the ratio by a part of about omega dt = 0.1.
    assert np.log2(coarse / fine) == pytest.approx(METHODS.index(integrator) + 1, abs=0.15)


@pytest.mark.slow
@pytest.mark.parametrize("integrator", METHODS)
def test_worlds_go_as_alone_and_go_on(gas, integrator, tmp_path):
    scenes = [gas(60), gas(40, seed=3)]
    run = functools.partial(simulate, integrator=integrator)
    together = equal_alone(run, scenes, "cpu", 4)
    together.save(tmp_path / "gas.npz")
    loaded = ps.Simulation.load(tmp_path / "gas.npz", scenes, device="cpu")
    for sim in (together, loaded):
        sim.run(3)
    for name in ("position", "velocity", "internal_energy"):
        assert np.array_equal(together.get(name), loaded.get(name))
    end = together.get("internal_energy")
    together.reset()
    together.run(7)
    assert np.array_equal(together.get("internal_energy"), end)


@pytest.mark.slow
def test_threads_and_graph_agree_bit_for_bit(gas):
    found = []
    for execution, threads in [("graph", 1), ("threads", 1), ("threads", 2)]:
        scene = gas(1200, dense=1.0)
        sim = simulate(scene, execution=execution, threads=threads, watchdog=False, dt=1e-3)
        sim.run(2)
        found.append(sim.get("internal_energy"))
    assert np.array_equal(found[0], found[1])
    assert np.array_equal(found[0], found[2])


def test_pinned_particles_are_heated_and_go_as_they_go(gas):
    scene = gas(pinned=np.arange(60) < 5)
    sim = simulate(scene)
    before = sim.get("internal_energy")
    sim.run(2)
    assert (sim.get("internal_energy")[:5] != before[:5]).all()
    assert np.array_equal(sim.velocity[:5], scene.velocity[:5])


def test_refuses_what_has_no_energy(cloud, gas):
    x, _, m = cloud(20)
    fluid = ps.SPH(smoothing_length=H, equation_of_state=ps.IdealGas(GAMMA))
    for energy, said in [({}, "internal_energy="), ({"internal_energy": -1.0}, "at least 0")]:
        scene = ps.Scene()
        scene.add_particles(x, mass=m, **energy)
        scene.add_interaction(fluid)
        with pytest.raises(ValueError, match=said):
            simulate(scene)
    with pytest.raises(ValueError, match="go back in time"):
        simulate(gas(), integrator="yoshida4")


def test_says_that_energies_fell_below_zero(gas):
    """A cold gas that is torn apart in one step far too long."""
    sim = simulate(gas(), dt=3.0, substeps=1, watchdog=False)
    sim.step()
    if not (sim.get("internal_energy") < 0).any():
        pytest.fail("the case is to take energies below 0")
    assert (sim.get("pressure") >= 0).all()
    with pytest.warns(ps.StabilityWarning, match="internal_energy must be at least 0"):
        sim.run(1)


@pytest.mark.slow
def test_isothermal_gas(prepared, fluid, cloud):
    x, _, m = cloud(60)
    sim = prepared(fluid(0.4 * x, m=m, equation_of_state=ps.Isothermal(3.0)))
    rho = sim.get("density")
    np.testing.assert_allclose(sim.get("pressure"), 9 * rho, rtol=1e-12)
    assert sim.diagnostics().potential[0] == pytest.approx((m * 9 * np.log(rho)).sum(), rel=1e-12)
