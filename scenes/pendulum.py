"""A pendulum swings far out, where its period is longer than that of small swings.

The error is that of the angle after the time simulated, against theta'' = -g/L sin(theta) solved
to 1e-13 by another method. A swing of 90 degrees takes 1.180341 times as long as a small one.
"""

import functools

import numpy as np

import particlesim as ps

frames = 120
settings = ps.Settings(dt=1 / 60, substeps=50, precision="float64")

GRAVITY, LENGTH = 9.81, 1.0


def build(angle: float = 90.0) -> ps.Scene:
    """A ball on a rigid rod of 1 m.

    Args:
        angle: At which it is let go, from hanging straight down [degrees].
    """
    theta = np.radians(angle)
    scene = ps.Scene()
    hinge = scene.add_particles([(0, 0, 0)], radius=0.02, pinned=True, group="hinge")
    ball = scene.add_particles(
        [(LENGTH * np.sin(theta), -LENGTH * np.cos(theta), 0)], radius=0.08, group="ball"
    )
    scene.add_interaction(ps.UniformGravity((0, -GRAVITY, 0)))
    scene.add_constraint(ps.Distance([(hinge[0], ball[0])]))
    return scene


def error(sim: ps.Simulation) -> float:
    """Difference of the angle from the exact one [rad]."""
    x, y, _ = sim.scenes[0].position[1]
    exact = swing(float(np.arctan2(x, -y)), sim.time)
    x, y, _ = sim.position[1]
    return abs(float(np.arctan2(x, -y)) - exact)


@functools.lru_cache(maxsize=1024)
def swing(start: float, time: float) -> float:
    """The exact angle, by the classical Runge-Kutta method in steps of a ten-thousandth second."""

    def slope(state: np.ndarray) -> np.ndarray:
        return np.array([state[1], -GRAVITY / LENGTH * np.sin(state[0])])

    steps = max(1, round(time * 1e4))
    h, state = time / steps, np.array([start, 0.0])
    for _ in range(steps):
        a = slope(state)
        b = slope(state + h / 2 * a)
        c = slope(state + h / 2 * b)
        state = state + h / 6 * (a + 2 * b + 2 * c + slope(state + h * c))
    return float(state[0])
