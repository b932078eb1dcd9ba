"""Langevin: exact exchange with the bath, and exact positions of oscillators at any step."""

import math

import numpy as np
import pytest

import particlesim as ps
from cases.closed_forms import trap
from cases.sampled import distributed, mean_of, normal, variance_of

COUNT, MASS, TEMPERATURE = 4000, 2.0, 1.5
THERMAL = math.sqrt(TEMPERATURE / MASS)


def gas(friction, stiffness=None, temperature=TEMPERATURE, seed=1, **options):
    scene = ps.Scene()
    atoms = scene.add_particles(np.zeros((COUNT, 3)), mass=MASS, **options)
    if stiffness is not None:
        scene.add_interaction(ps.ParticleForce(potential=trap, stiffness=stiffness))
    bath = ps.Langevin(atoms, temperature=temperature, friction=friction, seed=seed)
    scene.add_thermostat(bath)
    return scene


def simulate(scene, dt, substeps=1, integrator="velocity_verlet", **knobs):
    settings = ps.Settings(dt=dt, substeps=substeps, integrator=integrator, **knobs)
    return ps.Simulation(scene, settings, device="cpu")


def test_maxwell_and_boltzmann():
    # After 20 / gamma nothing is left of what was before, e^-20: independent draws in every frame.
    sim = simulate(gas(friction=20.0), dt=1.0)
    frames = []
    for _ in range(3):
        sim.step()
        frames.append(sim.velocity / THERMAL)
    v = np.array(frames)
    distributed(v, normal)
    # Kinetic energies in the canonical ensemble: 3/2 T on average, with a variance of 3/2 T^2.
    kinetic = 0.5 * (v**2).sum(axis=2)
    mean_of(kinetic, 1.5, deviation=math.sqrt(1.5))
    distributed(np.sqrt(2.0 * kinetic), speeds)
    # Nothing goes with anything else: products of two normal numbers have mean 0, variance 1.
    pairs = {
        "substeps": (v[0], v[1]), "particles": (v[:, 1:], v[:, :-1]),
        "axes": (v, np.roll(v, 1, axis=2)),
    }  # fmt: skip
    for a, b in pairs.values():
        mean_of(a * b, 0.0, deviation=1.0)


def speeds(v):
    """Maxwell's distribution of speeds in units of sqrt(T / m), up to v."""
    return 2.0 * normal(v) - 1.0 - math.sqrt(2.0 / math.pi) * v * np.exp(-0.5 * v**2)


@pytest.mark.parametrize("substeps", [1, 2])
def test_relaxation_is_that_of_ornstein_and_uhlenbeck(substeps):
    # <v> = v_0 e^(-gamma t), variance T / m (1 - e^(-2 gamma t)): at dt and dt / 2 alike.
    v0 = 3.0 * THERMAL
    sim = simulate(gas(friction=0.5, velocity=(v0, v0, v0)), dt=1.2, substeps=substeps)
    sim.step()
    left, spread = math.exp(-0.6), THERMAL * math.sqrt(1.0 - math.exp(-1.2))
    mean_of(sim.velocity, v0 * left, deviation=spread)
    variance_of(sim.velocity - v0 * left, spread**2)


@pytest.mark.parametrize("integrator", ["symplectic_euler", "velocity_verlet"])
def test_positions_of_oscillators_are_exact_at_a_large_step(integrator):
    # omega dt = 1.6, of 2. BAOAB: <x^2> = T / k whatever the step, and <v^2> at the end of a
    # substep T / m (1 - (omega dt)^2 / 4); with whole kicks v is half a step behind, where it is
    # T / m. (Leimkuhler and Matthews 2013; Zhang et al. 2019.)
    omega, phase = 3.0, 1.6
    stiffness = MASS * omega**2
    sim = simulate(
        gas(friction=2.0, stiffness=stiffness), phase / omega, integrator=integrator,
        watchdog=False,
    )  # fmt: skip
    x, v = [], []
    for _ in range(6):
        for _ in range(12):  # the chain forgets as 0.59^n: 0.002 is left
            sim.step()
        x.append(sim.position)
        v.append(sim.velocity)
    width = math.sqrt(TEMPERATURE / stiffness)
    distributed(np.array(x) / width, normal)
    variance_of(x, width**2)
    share = 1.0 - phase**2 / 4.0 if integrator == "velocity_verlet" else 1.0
    variance_of(v, share * THERMAL**2)


def test_a_ramp_of_temperatures():
    # Without any memory the temperature is that of the middle of the last drift.
    ramp = ((1.0, 2.0, 4.0), (1.0, 3.0, 2.0))
    sim = simulate(gas(friction=1e5, temperature=ramp), dt=0.5)
    for frame in range(10):
        sim.step()
        expected = np.interp(0.5 * frame + 0.25, *ramp)
        variance_of(sim.velocity, expected / MASS)


def dimers(count):
    """Two masses held at a distance each, far apart from each other: five degrees of freedom."""
    x = np.zeros((count, 2, 3))
    x[:, 1, 0] = 1.0
    scene = ps.Scene()
    atoms = scene.add_particles(x.reshape(-1, 3), mass=MASS)
    pairs = np.arange(2 * count).reshape(-1, 2)
    scene.add_constraint(ps.Distance(pairs, 1.0))
    scene.add_thermostat(ps.Langevin(atoms, temperature=TEMPERATURE, friction=2.0, seed=3))
    return scene


def test_what_constraints_hold_has_no_temperature():
    # At v dt = 0.02 of the length the projection is the rigid motion's but for the square of that.
    count = 2000
    sim = simulate(dimers(count), dt=2.0, substeps=100, integrator="symplectic_euler")
    kinetic = []
    for _ in range(4):  # e^-4 of a frame is left in the next one
        sim.step()
        v = sim.velocity.reshape(count, 2, 3)
        kinetic.append(0.5 * MASS * (v**2).sum(axis=(1, 2)) / TEMPERATURE)
    # From rest, the first frame is short of e^-8. Five halves, with a variance of five halves.
    mean_of(kinetic, 2.5, deviation=math.sqrt(2.5))
    apart = np.diff(sim.position.reshape(count, 2, 3), axis=1)[:, 0]
    np.testing.assert_allclose(np.linalg.norm(apart, axis=1), 1.0, atol=1e-3)
