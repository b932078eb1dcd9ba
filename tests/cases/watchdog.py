"""Scenes that go wrong, and how tests look at what the watchdog does."""

import warnings

import numpy as np
import warp as wp

import particlesim as ps


@ps.law
def spoiled(position: wp.vec3, time: float, when: float, push: float):
    """Nothing until ``when``; then a push without measure: 1e30 is finite, and 1e39 is not."""
    along = wp.vec3(push, 0.0, 0.0)
    return wp.where(time > when, along * (push * push), wp.vec3(0.0, 0.0, 0.0))


def drifting(*interactions, count=3, **options):
    """Particles at 0, 1, 2... on x that fly along y."""
    scene = ps.Scene(**options)
    x = np.zeros((count, 3))
    x[:, 0] = np.arange(count)
    scene.add_particles(x, velocity=(0, 1, 0))
    for interaction in interactions:
        scene.add_interaction(interaction)
    return scene


def oscillator(omega=1.0, length=1.0):
    """A mass on a spring of no length to a pin: x = length cos(omega t)."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], pinned=True)
    scene.add_particles([(length, 0, 0)])
    scene.add_interaction(ps.Springs([(0, 1)], omega**2, rest_length=0.0))
    return scene


def quietly(sim, frames):
    """Step without the reports of incidents; they are on ``sim.incidents``."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ps.SimulationWarning)
        for _ in range(frames):
            sim.step()


def same(ours, theirs):
    for name in ("position", "velocity"):
        np.testing.assert_array_equal(ours.get(name), theirs.get(name), err_msg=name)


# What has a cause -------------------------------------------------------------------------------


def falling():
    """From rest, to 10 m/s, across 50 extents, in a frame of a second."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (0.1, 0, 0)])
    scene.add_interaction(ps.UniformGravity((0, -10, 0)))
    return scene, ps.Settings(dt=1.0)


# Freeze and reset -------------------------------------------------------------------------------

WORLDS, SICK = 256, 97
