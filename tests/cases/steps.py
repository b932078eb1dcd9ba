"""Scenes whose largest step is known by running them: what they hold stiffens, or turns, later."""

import numpy as np
import warp as wp

import particlesim as ps


@ps.law
def harmonic(position: wp.vec3, k: float):
    return 0.5 * k * wp.dot(position, position)


@ps.law
def quartic(position: wp.vec3):
    return 0.25 * wp.dot(position, position) * wp.dot(position, position)


@ps.law
def stiffening(position: wp.vec3, time: float):
    return -(1.0 + 1000.0 * wp.min(time, 1.0)) * position


@ps.law
def soft_wall(position: wp.vec3):
    depth = wp.max(position[0] - 5.0, 0.0)
    return 0.5 * 1000.0 * depth * depth


@ps.law
def morse(r: float):
    e = 1.0 - wp.exp(-5.0 * (r - 1.0))
    return 10.0 * e * e


@ps.law
def attracting(r: float):
    return -wp.exp(-r) / wp.sqrt(r * r + 0.0001)


@ps.law
def repelling(r: float):
    return 50.0 * wp.exp(-r / 0.5) / r


@ps.law
def kepler(r: float):
    return -1.0 / r


@ps.law
def lorentz(velocity: wp.vec3, b: wp.vec3):
    return wp.cross(velocity, b)


def scene(x, *parts, **attributes):
    made = ps.Scene()
    made.add_particles(x, **attributes)
    for part in parts:
        made.add_interaction(part)
    return made


def pair(distance, part, speed=0.0, **attributes):
    """Two on the x axis, of mass 1, with a relative speed across."""
    v = [(0, -0.5 * speed, 0), (0, 0.5 * speed, 0)]
    return scene([(0, 0, 0), (distance, 0, 0)], part, velocity=v, **attributes)


def aphelion(part, e, gm=2.0):
    """At distance 1: v^2 = G m (1 - e) / r."""
    return pair(1.0, part, np.sqrt(gm * (1.0 - e)))


def chain(stiff):
    k = np.full(19, 50.0)
    k[9] = stiff
    x = [(i, 0.0, 0.0) for i in range(20)]
    v = np.zeros((20, 3))
    v[:, 0] = np.random.default_rng(2).normal(0, 0.05, 20)
    pairs = [(i, i + 1) for i in range(19)]
    return scene(x, ps.Springs(pairs, k, 1.0), velocity=v)


def gas(part, temperature, spacing=1.2, cells=4):
    side = cells * spacing
    made = ps.Scene(periodic=((0, 0, 0), (side, side, side)))
    x = ps.sample.lattice("sc", (cells, cells, cells), spacing)
    v = ps.sample.maxwell_boltzmann(len(x), temperature, 1.0, seed=1)
    made.add_particles(x, velocity=v)
    made.add_interaction(part)
    return made


def wca():
    return ps.LennardJones(cutoff=2 ** (1 / 6), truncation="shift")


# name: (scene, whether its energy is conserved, the time that the run takes to show)
STEPS = {
    "harmonic": (
        lambda: scene([(1, 0, 0)], ps.ParticleForce(potential=harmonic, k=4.0)), True, 60.0),
    "spring": (lambda: pair(1.3, ps.Springs([(0, 1)], 4.0, 1.0)), True, 60.0),
    "chain": (lambda: chain(50.0), True, 40.0),
    "chain with a stiff spring": (lambda: chain(5e4), True, 10.0),
    "liquid": (lambda: gas(ps.LennardJones(cutoff=2.0, truncation="shift"), 1.0), True, 5.0),
    "fast gas": (lambda: gas(ps.LennardJones(cutoff=2.0, truncation="shift"), 900.0), True, 1.0),
    "screened gas": (lambda: gas(ps.PairPotential(repelling, cutoff=2.3), 30.0), True, 3.0),
    "cold spheres": (lambda: gas(wca(), 1e-4), True, 400.0),
    "damped spring": (lambda: pair(1.3, ps.Springs([(0, 1)], 4.0, 1.0, damping=100.0)), False, 2.0),
    "quartic from outside": (
        lambda: scene([(10, 0, 0)], ps.ParticleForce(potential=quartic)), True, 10.0),
    "quartic from 0.01": (
        lambda: scene([(0.01, 0, 0)], ps.ParticleForce(potential=quartic), velocity=(10, 0, 0)),
        True, 40.0),
    "quartic from 0": (
        lambda: scene([(0, 0, 0)], ps.ParticleForce(potential=quartic), velocity=(10, 0, 0)),
        True, 40.0),
    "stiffening in time": (lambda: scene([(1, 0, 0)], ps.ParticleForce(stiffening)), False, 10.0),
    "soft wall": (
        lambda: scene([(0, 0, 0)], ps.ParticleForce(potential=soft_wall), velocity=(1, 0, 0)),
        True, 20.0),
    "dimer at rest": (lambda: pair(1.3, ps.LennardJones(cutoff=3.0)), True, 40.0),
    "Morse at rest": (lambda: pair(1.8, ps.PairPotential(morse, cutoff=4.0)), True, 40.0),
    "attracting": (lambda: pair(1.0, ps.PairPotential(attracting, cutoff=6.0), 0.2), True, 40.0),
    "Kepler law": (lambda: aphelion(ps.PairPotential(kepler, cutoff=None), 0.6), True, 30.0),
    "gravity": (lambda: aphelion(ps.Gravity(), 0.6), True, 30.0),
    "comet": (lambda: aphelion(ps.Gravity(), 0.95), True, 12.0),
    "magnetic": (
        lambda: scene([(1, 0, 0)], ps.ParticleForce(lorentz, b=(0, 0, 1.0)), velocity=(0, -1, 0)),
        True, 100.0),
    "drag from rest": (
        lambda: scene([(0, 0, 0)], ps.ConstantForce((100.0, 0, 0)), ps.Drag(0.0, 1.0)),
        False, 10.0),
}  # fmt: skip
