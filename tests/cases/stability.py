"""Scenes whose limits are known, for tests of stability."""

import particlesim as ps


def simulation(scene, device="cpu", **knobs):
    return ps.Simulation(scene, ps.Settings(**{"substeps": 1, **knobs}), device=device)


def limit(scene, **knobs):
    """The largest safe substep of a scene."""
    return simulation(scene, **knobs).stability().dt


def oscillator(stiffness=100.0, mass=2.0, start=1.3):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], pinned=True)
    scene.add_particles([(start, 0, 0)], mass=mass)
    scene.add_interaction(ps.Springs([(0, 1)], stiffness, 1.0))
    return scene


def chain(count, stiffness=50.0, mass=0.3):
    scene = ps.Scene()
    scene.add_particles([(k, 0, 0) for k in range(count)], mass=mass)
    scene.add_interaction(ps.Springs([(k, k + 1) for k in range(count - 1)], stiffness))
    return scene


# Contacts and constraints


def grains(velocity, distance=1.0):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (distance, 0, 0)], velocity=velocity, radius=0.02)
    scene.add_constraint(ps.Contact())
    return scene
