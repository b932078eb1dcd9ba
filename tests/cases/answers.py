"""Thirteen scenes whose motion is known at any time, and starts beside their own.

Each has ``build(**start)``, ``error(sim)``, its size the distance from the answer at the present
time, a tolerance, settings to begin with, and five other starts.
"""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import warp as wp

import particlesim as ps
from particlesim.scenes import pendulum, three_body

from .closed_forms import trap

NEAR = (0.96, 0.98, 0.99, 1.01, 1.02)  # of what is varied, other starts


@dataclass(frozen=True)
class Answer:
    """A scene whose motion is known."""

    build: Callable[..., ps.Scene]
    error: Callable[[Any], float]
    tolerance: float
    dt: float
    frames: int
    start: dict[str, float]
    settings: dict[str, Any] = field(default_factory=dict)

    @property
    def others(self) -> list[dict[str, float]]:
        """Five starts near its own."""
        name, value = next(iter(self.start.items()))
        return [{name: value * factor} for factor in NEAR]


def place(sim, k=-1):
    return np.asarray(sim.position[k], dtype=float)


def given(sim, k=-1):
    return np.asarray(sim.scenes[0].position[k], dtype=float)


def speed(sim, k=-1):
    return np.asarray(sim.scenes[0].velocity[k], dtype=float)


# Springs ----------------------------------------------------------------------------------------


def harmonic(amplitude=1.0):
    scene = ps.Scene()
    scene.add_particles([(amplitude, 0, 0)])
    scene.add_interaction(ps.ParticleForce(potential=trap, stiffness=1.0))
    return scene


def off_harmonic(sim):
    return float(np.linalg.norm(place(sim) - given(sim) * math.cos(sim.time)))


def dimer(stretch=0.2):
    """Two unit masses on a spring of k = 8: omega = 4 of their distance."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1 + stretch, 0, 0)])
    scene.add_interaction(ps.Springs([(0, 1)], stiffness=8.0, rest_length=1.0))
    return scene


def off_dimer(sim):
    stretch = given(sim)[0] - 1.0
    apart = place(sim)[0] - place(sim, 0)[0]
    return float(apart - 1.0 - stretch * math.cos(4.0 * sim.time))


def coupled(push=0.1):
    """Wall, two unit masses and wall, three springs: the modes of k and 3 k."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (3, 0, 0)], pinned=True)
    scene.add_particles([(1 + push, 0, 0), (2, 0, 0)])
    pairs = [(0, 2), (2, 3), (3, 1)]
    scene.add_interaction(ps.Springs(pairs, stiffness=5.0, rest_length=1.0))
    return scene


def off_coupled(sim):
    push = given(sim, 2)[0] - 1.0
    slow, fast = (0.5 * push * math.cos(math.sqrt(k) * sim.time) for k in (5.0, 15.0))
    return float(np.hypot(place(sim, 2)[0] - 1 - slow - fast, place(sim, 3)[0] - 2 - slow + fast))


SEGMENTS = 8


def string(amplitude=0.1):
    """A string of springs without a length of their own, whose first mode is exact at any size."""
    scene = ps.Scene()
    s = np.arange(SEGMENTS + 1) / SEGMENTS
    x = np.stack([s, amplitude * np.sin(np.pi * s), 0 * s], axis=1)
    held = np.isin(np.arange(SEGMENTS + 1), [0, SEGMENTS])
    scene.add_particles(x, mass=0.01, pinned=held)
    pairs = list(itertools.pairwise(range(SEGMENTS + 1)))
    scene.add_interaction(ps.Springs(pairs, stiffness=1.0, rest_length=0.0))
    return scene


def off_string(sim):
    omega = 2.0 * math.sqrt(1.0 / 0.01) * math.sin(math.pi / (2 * SEGMENTS))
    start = sim.scenes[0].position
    exact = start[:, 1] * math.cos(omega * sim.time)
    return float(np.abs(sim.position[:, 1] - exact).max())


def damped(stretch=0.2):
    """A unit mass on a damped spring at a wall: gamma = 0.5, omega^2 = 9."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], pinned=True)
    scene.add_particles([(1 + stretch, 0, 0)])
    scene.add_interaction(ps.Springs([(0, 1)], stiffness=9.0, rest_length=1.0, damping=1.0))
    return scene


def off_damped(sim):
    gamma, t = 0.5, sim.time
    omega = math.sqrt(9.0 - gamma**2)
    wave = math.cos(omega * t) + gamma / omega * math.sin(omega * t)
    return float(place(sim)[0] - 1 - (given(sim)[0] - 1) * math.exp(-gamma * t) * wave)


def compliant(stretch=0.2):
    """A unit mass on a compliant rod (XPBD): omega = 3."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], pinned=True)
    scene.add_particles([(1 + stretch, 0, 0)])
    scene.add_constraint(ps.Distance([(0, 1)], rest_length=1.0, compliance=1.0 / 9.0))
    return scene


def off_compliant(sim):
    return float(place(sim)[0] - 1 - (given(sim)[0] - 1) * math.cos(3.0 * sim.time))


# Flights ----------------------------------------------------------------------------------------


def thrown(up=3.0):
    """Thrown in air of linear drag, k / m = 0.5."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], velocity=(2, up, 0))
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    scene.add_interaction(ps.Drag(linear=0.5))
    return scene


def off_thrown(sim):
    k, t, g = 0.5, sim.time, np.array([0, -9.81, 0])
    gone = (1 - math.exp(-k * t)) / k
    return float(np.linalg.norm(place(sim) - (speed(sim) - g / k) * gone - g / k * t))


def braked(fast=5.0):
    """Quadratic drag, c / m = 0.3: v = v0 / (1 + c v0 t)."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], velocity=(fast, 0, 0))
    scene.add_interaction(ps.Drag(quadratic=0.3))
    return scene


def off_braked(sim):
    return float(place(sim)[0] - math.log1p(0.3 * speed(sim)[0] * sim.time) / 0.3)


@ps.law
def lorentz(velocity: wp.vec3, field: wp.vec3):
    return wp.cross(velocity, field)


def charge(fast=1.0):
    """A charge in a field: once round in 2 pi."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], velocity=(fast, 0, 0))
    scene.add_interaction(ps.ParticleForce(lorentz, field=(0, 0, 1)))
    return scene


def off_charge(sim):
    v, t = speed(sim)[0], sim.time
    return float(np.linalg.norm(place(sim) - v * np.array([math.sin(t), math.cos(t) - 1.0, 0.0])))


@ps.law
def drive(time: float, strength: float):
    return wp.vec3(strength * wp.cos(3.0 * time), 0.0, 0.0)


def driven(strength=1.0):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], strength=strength)
    scene.add_interaction(ps.ParticleForce(drive))
    return scene


def off_driven(sim):
    strength = float(sim.scenes[0].column("strength")[0])
    return float(place(sim)[0] - strength * (1.0 - math.cos(3.0 * sim.time)) / 9.0)


# Orbits and swings ------------------------------------------------------------------------------


def kepler(eccentricity=0.3):
    """From the perihelion, G M = a = 1."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], pinned=True)
    e = eccentricity
    scene.add_particles([(1 - e, 0, 0)], velocity=(0, math.sqrt((1 + e) / (1 - e)), 0))
    scene.add_interaction(ps.Gravity(G=1.0))
    return scene


def off_kepler(sim):
    e, anomaly = 1.0 - given(sim)[0], sim.time
    for _ in range(50):  # Newton's method for Kepler's equation
        anomaly -= (anomaly - e * math.sin(anomaly) - sim.time) / (1 - e * math.cos(anomaly))
    exact = [math.cos(anomaly) - e, math.sqrt(1 - e * e) * math.sin(anomaly), 0]
    return float(np.linalg.norm(place(sim) - exact))


def eight(scale=1.0):
    """The figure eight, in units of length that differ: times go as their power of 3/2."""
    scene = three_body.build()
    x, v = scene.position * scale, scene.velocity / math.sqrt(scale)
    scene = ps.Scene(up_axis="z")
    scene.add_particles(x, velocity=v, mass=1.0)
    scene.add_interaction(ps.Gravity(G=1.0))
    return scene


STEP = 1e-3
EIGHT = [np.stack([three_body.build().position, three_body.build().velocity]).astype(float)]


def on_the_eight(time):
    """Positions by Runge and Kutta's method of fourth order in steps of 1e-3, to 1e-10."""
    while len(EIGHT) <= time / STEP:
        EIGHT.append(_moved(EIGHT[-1], STEP))
    whole = int(time / STEP)
    return _moved(EIGHT[whole], time - whole * STEP)[0]


def _moved(state, h):
    def slope(state):
        x, v = state
        d = x[None] - x[:, None]
        r3 = (d**2).sum(-1) ** 1.5 + np.eye(3)
        return np.stack([v, (d / r3[..., None]).sum(1)])

    a = slope(state)
    b = slope(state + h / 2 * a)
    c = slope(state + h / 2 * b)
    return state + h / 6 * (a + 2 * b + 2 * c + slope(state + h * c))


def off_eight(sim):
    scale = sim.scenes[0].position[0, 0] / 0.97000436
    exact = scale * on_the_eight(sim.time / scale**1.5)
    return float(np.linalg.norm(sim.position - exact, axis=1).max())


ANSWERS = {
    "harmonic": Answer(harmonic, off_harmonic, 1e-4, math.pi / 6, 24, {"amplitude": 1.0}),
    "dimer": Answer(dimer, off_dimer, 1e-3, 0.1, 50, {"stretch": 0.2}),
    "coupled": Answer(coupled, off_coupled, 1e-4, 0.1, 60, {"push": 0.1}),
    "string": Answer(string, off_string, 1e-4, 0.05, 40, {"amplitude": 0.1}),
    "damped": Answer(damped, off_damped, 1e-4, 0.1, 40, {"stretch": 0.2}),
    "compliant": Answer(compliant, off_compliant, 5e-3, 0.1, 30, {"stretch": 0.2}),
    "thrown": Answer(thrown, off_thrown, 1e-3, 0.05, 30, {"up": 3.0}),
    "braked": Answer(braked, off_braked, 1e-3, 0.1, 40, {"fast": 5.0}),
    "charge": Answer(charge, off_charge, 1e-3, math.pi / 10, 30, {"fast": 1.0}),
    "driven": Answer(driven, off_driven, 1e-4, 0.1, 40, {"strength": 1.0}),
    "kepler": Answer(kepler, off_kepler, 1e-3, math.pi / 10, 40, {"eccentricity": 0.3}),
    "eight": Answer(eight, off_eight, 1e-4, three_body.PERIOD / 60, 60, {"scale": 1.0}),
    "pendulum": Answer(pendulum.build, pendulum.error, 1e-2, 1 / 30, 40, {"angle": 60.0}),
}
