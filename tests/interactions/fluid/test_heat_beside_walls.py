"""Gases with heat beside walls: images heat as particles would, walls work as pistons do."""

import numpy as np
import pytest

import particlesim as ps
from cases.worlds import equal_alone, goes_on_after_reset_and_save
from particlesim.engine.model import Model

SIZE, GAMMA = 0.1, 1.4
VISCOSITY = [ps.ArtificialViscosity(1.0, 2.0), ps.LaminarViscosity(0.02)]
NORMALS = np.eye(3)
LONG = pytest.mark.slow


def corner(jitter=0.3, seed=1):
    """Places, velocities and energies of a quick gas in a corner, and no wall gives way."""
    random = np.random.default_rng(seed)
    x = ps.sample.box((0, 0, 0), (0.3, 0.3, 0.3), SIZE, jitter=jitter, seed=seed)
    x = np.maximum(x, 0.51 * SIZE)
    return x, 0.5 * random.normal(size=x.shape), random.uniform(1, 2, len(x))


def gas(x, v, u, boundaries=(), viscosity=VISCOSITY):
    scene = ps.Scene()
    scene.add_particles(x, velocity=v, mass=SIZE**3, internal_energy=u, radius=1e-6)
    scene.add_interaction(
        ps.SPH(smoothing_length=1.3 * SIZE, equation_of_state=ps.IdealGas(GAMMA),
               viscosity=viscosity)
    )  # fmt: skip
    for each in boundaries:
        scene.add_constraint(each)
    return scene


def simulate(scenes, device="cpu", **knobs):
    settings = ps.Settings(dt=2e-3, substeps=2, precision="float64", **knobs)
    return ps.Simulation(scenes, settings, device=device)


def planes(**options):
    return [ps.PlaneBoundary((0, 0, 0), n, **options) for n in NORMALS]


@LONG
def test_images_heat_as_particles_behind_the_walls_would():
    """A corner of three planes against the eight octants that it stands for."""
    x, v, u = corner()
    signs = np.array(np.meshgrid(*[[1, -1]] * 3, indexing="ij")).reshape(3, 8).T
    whole = gas(*(np.concatenate([a * s for s in signs]) for a in (x, v)), np.tile(u, 8))
    one, eight = simulate(gas(x, v, u, planes())), simulate(whole)
    one.run(3)
    eight.run(3)
    found, expected = (sim.get("internal_energy")[: len(x)] for sim in (one, eight))
    assert np.abs(expected - u).max() > 0.01
    # Six steps of sums of some 60 terms of order 1, each rounded in another order.
    np.testing.assert_allclose(found, expected, rtol=1e-12)


@pytest.mark.parametrize(
    "integrator", ["symplectic_euler", pytest.param("velocity_verlet", marks=LONG)]
)
@pytest.mark.parametrize(
    "slips",
    [(False,), *(pytest.param(each, marks=LONG) for each in ((True, True), (False, True)))],
)
@pytest.mark.slow
def test_first_law_beside_walls(slips, integrator):
    """Kinetic and internal energy are one sum, to round-off, also in corners and where it sticks.

    Whatever the step: walls at rest do no work.
    """
    held = [
        ps.PlaneBoundary((0, 0, 0), n, slip=slip) for n, slip in zip(NORMALS, slips, strict=False)
    ]
    sim = simulate(gas(*corner(), held), integrator=integrator)
    start = sim.diagnostics()
    sim.run(5)
    end = sim.diagnostics()
    assert abs(end.kinetic[0] - start.kinetic[0]) > 0.05 * start.kinetic[0]
    assert end.energy[0] == pytest.approx(start.energy[0], rel=1e-13)  # ten steps, round-off


@LONG
def test_vectorised_loops_heat_as_plain_ones(monkeypatch):
    found = []
    for vectorised in (True, False):
        monkeypatch.setattr(Model, "vectorised", vectorised)
        sim = simulate(gas(*corner(), planes(velocity=(0.1, 0, 0), slip=False)))
        sim.run(2)
        found.append(sim.get("internal_energy"))
    np.testing.assert_allclose(*found, rtol=1e-13)  # four steps, sums in another order


@LONG
def test_bits(tmp_path, device):
    """Threads, batches, resets and restarts, with a start in the walls and one that moves."""

    def scene(seed):
        x, v, u = corner(seed=seed)
        return gas(x - 0.03, v, u, planes(velocity=(0.1, 0, 0), slip=False))

    scenes = [scene(1), scene(2)]
    together = equal_alone(simulate, scenes, device, 5)
    one, two = (simulate(scenes, device, threads=threads) for threads in (1, 2))
    one.run(5)
    two.run(5)
    for sim in (one, two):
        for name in ("position", "internal_energy"):
            assert np.array_equal(sim.get(name), together.get(name))
    goes_on_after_reset_and_save(simulate, scenes, device, tmp_path / "gas.npz")
