"""Newton's cradle: the ball that falls on one end sends up the one at the other end.

The error is that of the angles against balls that swing one after the other, each for half of a
period of theta'' = -g/L sin(theta): the first down, the last up and down, the first up.
"""

import numpy as np

import particlesim as ps

frames = 240
settings = ps.Settings(dt=1 / 60, substeps=200, precision="float64")

GRAVITY = 9.81  # [m/s^2]
LENGTH, RADIUS = 0.3, 0.02  # of the threads, and of the balls [m]
GAP = 2.5e-4  # between balls at rest, so that they meet one after the other [m]


def build(balls: int = 5, raised: int = 1, angle: float = 40.0) -> ps.Scene:
    """Balls of steel on two threads each.

    Args:
        balls: How many.
        raised: How many of them are let go.
        angle: At which they are let go, from hanging straight down [degrees].
    """
    theta = np.radians(angle)
    scene = ps.Scene()
    along = (np.arange(balls) - 0.5 * (balls - 1)) * (2 * RADIUS + GAP)
    x = np.stack([along, 0 * along - LENGTH, 0 * along], axis=1)
    x[:raised] += LENGTH * np.array([-np.sin(theta), 1 - np.cos(theta), 0])
    mass = 7800 * 4 / 3 * np.pi * RADIUS**3
    row = scene.add_particles(x, mass=mass, radius=RADIUS, group="balls", color=(0.7, 0.7, 0.75))
    for side in (-0.5 * LENGTH, 0.5 * LENGTH):
        nails = np.stack([along, 0 * along, 0 * along + side], axis=1)
        held = scene.add_particles(nails, radius=0.0, pinned=True)
        pairs = np.stack([row.indices, held.indices], axis=1)
        scene.add_constraint(ps.Distance(pairs, tension_only=True))
    scene.add_interaction(ps.UniformGravity((0, -GRAVITY, 0)))
    scene.add_constraint(ps.Contact(row, restitution=1.0))
    return scene


def angles(sim: ps.Simulation) -> np.ndarray:
    """Of each ball from hanging straight down [rad], to the right positive."""
    balls, nails, _ = sim.scenes[0].groups
    x = sim.position[balls.slice] - sim.position[nails.slice]
    return np.arctan2(x[:, 0], -x[:, 1])


def error(sim: ps.Simulation) -> float:
    """Largest difference of an angle from that of balls that take turns [rad]."""
    (scene,) = sim.scenes
    height = scene.position[scene.groups[0].slice, 1]
    way = swing(float(np.arccos(-height[0] / LENGTH)), sim.time)
    raised = height == height[0]
    # As the first ones are on their side of the middle, or those at the other end on theirs.
    expected = np.where(raised, min(-way, 0.0), 0.0) + np.where(raised[::-1], max(-way, 0.0), 0.0)
    return float(np.abs(angles(sim) - expected).max())


def swing(start: float, time: float) -> float:
    """The angle of a pendulum: 2 asin(k sn(omega t + K, k)), k = sin(start / 2) (Jacobi 1829).

    By the arithmetic-geometric mean (Abramowitz and Stegun 1964, 16.4).
    """
    k = np.sin(start / 2)
    a, b, ratios = 1.0, np.sqrt(1 - k**2), []
    for _ in range(8):
        a, b, c = (a + b) / 2, np.sqrt(a * b), (a - b) / 2
        ratios.append(c / a)
    phase = 2 ** len(ratios) * (a * np.sqrt(GRAVITY / LENGTH) * time + np.pi / 2)
    for ratio in reversed(ratios):
        phase = (phase + np.arcsin(ratio * np.sin(phase))) / 2
    return float(2 * np.arcsin(k * np.sin(phase)))
