"""Velocity rescaling: the kinetic energy of a group is canonical, and relaxes as it should."""

import math

import numpy as np
import pytest

import particlesim as ps
from cases.sampled import distributed, gamma, mean_of

TEMPERATURE = 0.7


def scene(count, degrees=None, seed=0, speed=1.0, tau=1.0):
    """Atoms that fly freely, of masses 1, 2, 3, ..."""
    built = ps.Scene()
    v = np.random.default_rng(seed).normal(size=(count, 3)) * speed
    atoms = built.add_particles(np.zeros((count, 3)), mass=1.0 + np.arange(count), velocity=v)
    bath = ps.VelocityRescaling(
        atoms, temperature=TEMPERATURE, relaxation_time=tau, degrees_of_freedom=degrees, seed=seed
    )
    built.add_thermostat(bath)
    return built


def test_kinetic_energies_are_canonical():
    # K / T is of the gamma distribution of N_f / 2. A frame is 12 tau: e^-12 of it is remembered.
    degrees = (1, 2, 3, 4, 12)
    counts = (1, 1, 1, 2, 4)
    scenes = [
        scene(n, None if each == 3 * n else each, seed=each)
        for n, each in zip(counts, degrees, strict=True)
    ]
    sim = ps.Simulation(scenes, ps.Settings(dt=12.0, substeps=1), device="cpu")
    weights = np.concatenate([each.mass for each in scenes])
    frames = 1500
    kinetic, signs = np.zeros((frames, len(scenes))), []
    for k in range(frames):
        sim.step()
        twice = (weights[:, None] * sim.velocity.astype(float) ** 2).sum(axis=1)
        kinetic[k] = 0.5 * np.bincount(sim.model.world_of, twice) / TEMPERATURE
        signs.append(np.sign(sim.velocity[0, 0]))
    for each, sample in zip(degrees, kinetic.T, strict=True):
        distributed(sample, lambda x, each=each: gamma(x, each))
        # Its mean and its variance are both N_f / 2.
        mean_of(sample, 0.5 * each, deviation=math.sqrt(0.5 * each))
    # Of a single degree of freedom either direction is as likely.
    mean_of(signs, 0.0, deviation=1.0)


@pytest.mark.parametrize("substeps", [1, 2])
def test_relaxation(substeps):
    # <K> = K_0 + (K - K_0) e^(-t / tau), at dt and dt / 2 alike, and a spread of less than the
    # canonical sqrt(2 / N_f): with N_f = 9000, 1.5 %.
    count = 3000
    built = scene(count, speed=0.1)
    before = 0.5 * (built.mass[:, None] * built.velocity**2).sum()
    settings = ps.Settings(dt=1.3, substeps=substeps, integrator="velocity_verlet")
    sim = ps.Simulation(built, settings, device="cpu")
    direction = built.velocity / np.linalg.norm(built.velocity)
    sim.step()
    canonical, left = 1.5 * count * TEMPERATURE, math.exp(-1.3)
    expected = canonical + (before - canonical) * left
    got = sim.diagnostics().kinetic[0]
    assert abs(got / expected - 1) < 4 * math.sqrt(2 / (3 * count))
    # All go on as they went, but for rounding.
    after = sim.velocity / np.linalg.norm(sim.velocity)
    np.testing.assert_allclose(after, direction, rtol=0, atol=1e-6)


def test_what_is_at_rest_stays_so():
    sim = ps.Simulation(scene(3, speed=0.0), ps.Settings(dt=1.0), device="cpu")
    sim.run(2)
    np.testing.assert_array_equal(sim.velocity, 0.0)
