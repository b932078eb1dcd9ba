"""Single runs whose numbers are known by closed forms: each case is another of its kind."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import particlesim as ps

VERLET = "velocity_verlet"


@dataclass
class Case:
    """One measurement: its arguments, the true value, and the options that a plain run takes."""

    build: Any
    observe: Any
    truth: float
    error: float
    arguments: dict = field(default_factory=dict)


# Closed forms


def pendulum(angle=30.0):
    scene = ps.Scene()
    theta = math.radians(angle)
    ends = [(0, 0, 0), (math.sin(theta), -math.cos(theta), 0)]
    scene.add_particles(ends, pinned=np.array([True, False]))
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    scene.add_constraint(ps.Distance([(0, 1)]))
    return scene


def aside(sim):
    """x of the second particle of each world."""
    return sim.position[1::2, 0]


def pendulums(k):
    # T = 2 pi sqrt(L / g) / M(1, cos(theta / 2)), M the arithmetic-geometric mean (Gauss 1799).
    angle = 15.0 + 5.0 * k
    a, b = 1.0, math.cos(math.radians(angle) / 2)
    for _ in range(8):
        a, b = (a + b) / 2, math.sqrt(a * b)
    truth = 2 * math.pi / math.sqrt(9.81) / a
    settings = ps.Settings(dt=0.02 + 0.0007 * k, substeps=16)
    arguments = dict(over="period", frames=330, settings=settings, options={"angle": angle})
    return Case(pendulum, aside, truth, 2e-4, arguments)


def spring(stiffness=100.0, stretch=0.2, damping=0.0):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1 + stretch, 0, 0)], pinned=np.array([True, False]))
    scene.add_interaction(ps.Springs([(0, 1)], stiffness, 1.0, damping))
    return scene


def oscillators(k):
    omega = 7.0 + 0.3 * k
    settings = ps.Settings(dt=0.03, integrator=VERLET if k % 2 else "symplectic_euler")
    arguments = dict(
        over="period", frames=200, settings=settings, options={"stiffness": omega**2}
    )  # fmt: skip
    return Case(spring, aside, 2 * math.pi / omega, 2e-5, arguments)


def planet(eccentricity=0.3):
    """From perihelion at 1 - e, semi-major axis 1, G M = 1."""
    e = eccentricity
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], mass=1.0, pinned=True)
    v = math.sqrt((1 + e) / (1 - e))
    scene.add_particles([(1 - e, 0, 0)], velocity=(0, v, 0), mass=1e-12)
    scene.add_interaction(ps.Gravity(G=1.0, softening=0.0))
    return scene


def planets(k):
    e, time = 0.05 + 0.025 * k, 4.0 + 0.1 * k
    anomaly = time
    for _ in range(100):  # M = E - e sin E (Kepler 1609), by Newton
        anomaly -= (anomaly - e * math.sin(anomaly) - time) / (1 - e * math.cos(anomaly))
    settings = ps.Settings(dt=time / 40, integrator=VERLET)
    arguments = dict(frames=40, settings=settings, options={"eccentricity": e})
    return Case(planet, aside, math.cos(anomaly) - e, 2e-4, arguments)


def string(particles=6, mode=1):
    """Of length, tension and mass 1, plucked in a mode."""
    n = particles
    x = np.linspace(0.0, 1.0, n + 1)
    y = 1e-3 * np.sin(mode * math.pi * x)
    pinned = np.zeros(n + 1, bool)
    pinned[[0, -1]] = True
    scene = ps.Scene()
    scene.add_particles(np.c_[x, y, 0 * x], mass=1.0 / n, pinned=pinned)
    pairs = np.c_[np.arange(n), np.arange(1, n + 1)]
    scene.add_interaction(ps.Springs(pairs, 2.0 * n, 0.5 / n))
    return scene


def plucked(sim):
    """What there is of the first mode."""
    x = sim.scenes[0].position[:, 0]
    return float(sim.position[:, 1] @ np.sin(math.pi * x)) * 2 / (len(x) - 1)


def strings(k):
    # c = sqrt(T / mu) = 1: period 2 L / c; it stretches by 1e-6, and so does the tension.
    settings = ps.Settings(dt=0.05 + 0.001 * k, integrator=VERLET)
    arguments = dict(over="period", frames=130, settings=settings, options={"particles": 5 + k % 6})
    return Case(string, plucked, 2.0, 2e-3, arguments)


def ball(speed=20.0, drag=0.02, lift=0.7):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], velocity=(speed * math.cos(lift), speed * math.sin(lift), 0))
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    scene.add_interaction(ps.Drag(quadratic=drag))
    return scene


def height(sim):
    return sim.position[:, 1]


def balls(k):
    speed, drag, lift, time = 10.0 + 2.0 * k, 0.02, 0.5 + 0.03 * k, 1.5
    state, steps = np.array([0, 0, speed * math.cos(lift), speed * math.sin(lift)]), 4000

    def slope(s):
        a = -drag * math.hypot(s[2], s[3])
        return np.array([s[2], s[3], a * s[2], a * s[3] - 9.81])

    h = time / steps
    for _ in range(steps):  # classical Runge-Kutta: to 1e-12
        p = slope(state)
        q = slope(state + h / 2 * p)
        r = slope(state + h / 2 * q)
        state = state + h / 6 * (p + 2 * q + 2 * r + slope(state + h * r))
    settings = ps.Settings(dt=time / 15, integrator=VERLET if k % 2 else "symplectic_euler")
    options = {"speed": speed, "drag": drag, "lift": lift}
    arguments = dict(frames=15, settings=settings, options=options)
    # Each to what its order reaches in some hundred substeps, and not in the first that is tried.
    return Case(ball, height, float(state[1]), 3e-5 if k % 2 else 3e-3, arguments)
