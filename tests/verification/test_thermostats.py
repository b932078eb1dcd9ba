"""Thermostats against published numbers: a liquid at a temperature, at any step that is stable."""

import numpy as np
import pytest

import particlesim as ps
from cases.sampled import SIGMAS

TEMPERATURE, DENSITY, CELLS = 1.0, 0.75, 4
COUNT = 4 * CELLS**3
FRAMES, APART = 250, 1.0  # samples, and the time between them
# Thol et al. for the fluid cut and shifted at 2.5, rho 0.75, T 1: E/N = -2.929 = 3/2 + U/N.
POTENTIAL = -2.929 - 1.5


def sampled(bath, dt, integrator):
    """Kinetic energies over T and potential energies an atom, in equilibrium."""
    side = (COUNT / DENSITY) ** (1 / 3)
    scene = ps.Scene(periodic=((0, 0, 0), (side, side, side)))
    atoms = scene.add_particles(
        ps.sample.lattice("fcc", (CELLS,) * 3, side / CELLS),
        velocity=ps.sample.maxwell_boltzmann(COUNT, TEMPERATURE, 1.0, seed=1),
    )
    scene.add_interaction(ps.LennardJones(atoms, cutoff=2.5, truncation="shift"))
    scene.add_thermostat(bath(atoms))
    settings = ps.Settings(dt=APART, substeps=round(APART / dt), integrator=integrator)
    sim = ps.Simulation(scene, settings, device="cpu")
    sim.run(20)
    rows = []
    for _ in range(FRAMES):
        sim.step()
        found = sim.diagnostics()
        rows.append((found.kinetic[0] / TEMPERATURE, found.potential[0] / COUNT))
    return np.array(rows).T


def langevin(atoms):
    return ps.Langevin(atoms, temperature=TEMPERATURE, friction=2.0, seed=2)


def rescaling(atoms):
    return ps.VelocityRescaling(
        atoms, temperature=TEMPERATURE, relaxation_time=0.2, degrees_of_freedom=3 * COUNT - 3,
        seed=2,
    )  # fmt: skip


def spread(series, blocks=25):
    """The standard error of a mean, by means of blocks of ten samples, which are independent."""
    means = series.reshape(blocks, -1).mean(axis=1)
    return means.std(ddof=1) / np.sqrt(blocks)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("bath", "integrator", "degrees"),
    [
        (langevin, "symplectic_euler", 3 * COUNT),
        (langevin, "velocity_verlet", 3 * COUNT),
        (rescaling, "velocity_verlet", 3 * COUNT - 3),
    ],
)
def test_a_liquid_is_canonical_at_either_step(bath, integrator, degrees):
    potentials = []
    for dt in (0.008, 0.004):
        kinetic, potential = sampled(bath, dt, integrator)
        # Mean and variance N_f / 2 each. With velocity Verlet and friction the velocities at the
        # end of a substep are cold by (omega dt)^2 / 4, omega^2 = 200 to 300 of an atom among its
        # neighbours: up to 0.005 of the mean. A sample's variance has sqrt(2 / n) of itself.
        cold = 300 * dt**2 / 4 if (bath, integrator) == (langevin, "velocity_verlet") else 0.0
        off = kinetic.mean() / (0.5 * degrees) - 1
        error = spread(kinetic) / (0.5 * degrees)
        assert -SIGMAS * error - cold < off < SIGMAS * error
        assert kinetic.var() / (0.5 * degrees) == pytest.approx(1, abs=4 * np.sqrt(2 / FRAMES))
        potentials.append((potential.mean(), spread(potential)))
        # The equation of state is good for 0.005, as in test_molecular.py.
        assert abs(potential.mean() - POTENTIAL) < SIGMAS * spread(potential) + 0.005
    (coarse, a), (fine, b) = potentials
    assert abs(coarse - fine) < SIGMAS * np.hypot(a, b)
