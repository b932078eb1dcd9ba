"""Scenes whose answers are closed forms, for tests of errors, costs and tuning."""

import math

import numpy as np
import warp as wp

import particlesim as ps

TURN = 2.0 * math.pi
EXACT = {"integrator": "velocity_verlet", "precision": "float64"}


@ps.law
def trap(position: wp.vec3, stiffness: float):
    return 0.5 * stiffness * wp.dot(position, position)


def harmonic(amplitude=1.0, held=0, seed=None):
    """Unit mass in a trap of omega = 1, let go at x = amplitude; beside ``held`` pinned ones."""
    scene = ps.Scene()
    if seed is not None:
        amplitude *= np.random.default_rng(seed).uniform(0.9, 1.0)
    one = scene.add_particles([(amplitude, 0, 0)])
    if held:
        wall = np.stack([np.arange(held), np.full(held, 5), np.zeros(held)], axis=1)
        scene.add_particles(wall, pinned=True)
    scene.add_interaction(ps.ParticleForce(potential=trap, group=one, stiffness=1.0))
    return scene


def off_harmonic(sim):
    """x less its closed form a cos t."""
    return sim.position[0, 0] - sim.scenes[0].position[0, 0] * math.cos(sim.time)


def two_turns(frames=24, **knobs):
    """Settings of frames that make two whole periods."""
    return ps.Settings(dt=2 * TURN / frames, **{**EXACT, **knobs})


def along(build, settings, frames, error, **options):
    """The error at every frame of a run, (frames,)."""
    sim = ps.Simulation(build(**options), settings, device="cpu")
    found = []
    for _ in range(frames):
        sim.step()
        found.append(abs(error(sim)))
    return np.array(found)
