"""Steps: "auto" keeps scenes bounded and their energy, and limits are those that runs have.

Every scene of :mod:`cases.steps` starts where its forces are soft, or nothing acts yet, and becomes
stiff later, or turns, or is damped.
"""

import warnings

import numpy as np
import pytest

import particlesim as ps
from cases.steps import STEPS

INTEGRATORS = ("symplectic_euler", "velocity_verlet")
FRAMES = {1: 300, 10: 3000}  # of one run, at most, by substeps
DAMPED = "drag from rest"  # implicit: no step is too large for it


def ran(name, integrator, substeps):
    """Energies of the start and every frame, and how far anything was from the origin."""
    build, _, span = STEPS[name]
    settings = ps.Settings(dt="auto", substeps=substeps, integrator=integrator, precision="float64")
    sim = ps.Simulation(build(), settings, device="cpu")
    energies, far = [sim.diagnostics().energy[0]], 0.0
    for _ in range(min(FRAMES[substeps], int(span / sim.settings.dt) + 1)):
        sim.step()
        energies.append(sim.diagnostics().energy[0])
        far = max(far, np.abs(sim.position).max())
    return np.array(energies), far


@pytest.mark.slow
@pytest.mark.parametrize("substeps", [1, 10])
@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("name", STEPS)
def test_auto_keeps_the_energy(name, integrator, substeps):
    with warnings.catch_warnings():
        warnings.simplefilter("error", ps.StabilityWarning)
        energies, far = ran(name, integrator, substeps)
    start = np.abs(STEPS[name][0]().position).max()
    assert far < 200.0 * max(start, 1.0)  # what drag lets go goes 100
    if STEPS[name][1]:
        # What "auto" promises, where it can: of an energy that is not all but zero.
        assert np.abs(energies - energies[0]).max() <= 0.1 * abs(energies[0])


def bounded(name, integrator, dt):
    """The largest kinetic energy and distance that a run with this step has."""
    build, _, span = STEPS[name]
    count = max(1, int(np.ceil(span / dt)))
    settings = ps.Settings(
        dt=span / count, substeps=1, precision="float64", integrator=integrator, watchdog=False
    )
    sim = ps.Simulation(build(), settings, device="cpu")
    most = np.zeros(2)
    for _ in range(count):
        sim.step()
        x, v = sim.position, sim.velocity
        size = np.abs(x - x.mean(axis=0) if len(x) > 1 else x).max()
        most = np.maximum(most, [(v**2).sum(), size])
        if not (most < 1e12).all():  # NaN, too
            return np.full(2, np.inf)
    return most


def largest(name, integrator, guess):
    """By bisection: neither faster nor farther than three times what a fine run is."""
    low = max(guess / 20, STEPS[name][2] / 20_000)
    fine = bounded(name, integrator, low)
    high = 1.5 * low
    while high < STEPS[name][2] and (bounded(name, integrator, high) <= 3 * fine).all():
        low, high = high, 1.5 * high
    for _ in range(6):
        middle = np.sqrt(low * high)
        if (bounded(name, integrator, middle) <= 3 * fine).all():
            low = middle
        else:
            high = middle
    return low


@pytest.mark.slow
@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("name", [name for name in STEPS if name != DAMPED])
def test_the_limit_is_that_of_runs(name, integrator):
    settings = ps.Settings(precision="float64", integrator=integrator)
    limit = ps.Simulation(STEPS[name][0](), settings, device="cpu").stability().dt
    true = largest(name, integrator, limit)
    assert 0.25 * true <= limit <= 1.3 * true
