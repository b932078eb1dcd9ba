"""A barostat against published numbers: a liquid at a pressure has the density that it should."""

import numpy as np
import pytest

import particlesim as ps
from cases.sampled import SIGMAS

# Thol et al. for the fluid cut and shifted at 2.5: at T 1 and rho 0.75 a pressure of 0.990.
TEMPERATURE, PRESSURE, DENSITY, CELLS = 1.0, 0.990, 0.75, 4
COUNT = 4 * CELLS**3
COMPRESSIBILITY = 0.126  # there, as volumes vary


@pytest.mark.slow
@pytest.mark.parametrize("integrator", ["symplectic_euler", "velocity_verlet"])
def test_a_liquid_at_a_pressure(integrator):
    side = (COUNT / (0.9 * DENSITY)) ** (1 / 3)  # from a box that is too large
    scene = ps.Scene(periodic=((0, 0, 0), (side,) * 3))
    atoms = scene.add_particles(
        ps.sample.lattice("fcc", (CELLS,) * 3, side / CELLS),
        velocity=ps.sample.maxwell_boltzmann(COUNT, 2 * TEMPERATURE, 1.0, seed=1),
    )
    scene.add_interaction(ps.LennardJones(atoms, cutoff=2.5, truncation="shift"))
    scene.add_thermostat(ps.Langevin(temperature=TEMPERATURE, friction=2.0, seed=1))
    scene.add_barostat(
        ps.CellRescaling(
            pressure=PRESSURE, compressibility=COMPRESSIBILITY, relaxation_time=0.5, seed=1
        )
    )
    settings = ps.Settings(dt=0.5, substeps=125, integrator=integrator)
    sim = ps.Simulation(scene, settings, device="cpu")
    sim.run(40)
    rows = []
    for _ in range(1500):
        sim.step()
        found = sim.diagnostics()
        rows.append((found.volume[0], found.pressure[0]))
    volume, pressure = np.array(rows).T

    def error(series):
        """Of the mean, by blocks of 50 relaxation times."""
        means = series.reshape(30, -1).mean(axis=1)
        return means.std(ddof=1) / np.sqrt(30)

    # The equation of state is good for a pressure of 0.03 in so small a box, as in
    # test_molecular.py, which is as much of the density, times the compressibility.
    off = COUNT / volume.mean() / DENSITY - 1
    assert abs(off) < SIGMAS * error(volume) / volume.mean() + 0.03 * COMPRESSIBILITY
    assert abs(pressure.mean() - PRESSURE) < SIGMAS * error(pressure)
    # Var V = T beta V. Of a variance by samples a relaxation time apart, 2.2 of them as good as
    # one: sqrt(4.4 / 1500) of itself; beta is that of the longest run there was, to a tenth.
    known = TEMPERATURE * COMPRESSIBILITY * volume.mean()
    assert volume.var() == pytest.approx(known, rel=SIGMAS * np.sqrt(4.4 / 1500) + 0.1)
