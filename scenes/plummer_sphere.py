"""A star cluster in equilibrium stays as it is.

Plummer's sphere (1911) with isotropic velocities (Aarseth, Henon and Wielen 1974), in units of its
scale, its mass and G = 1; forces by a tree. Its density, and with it the virial ratio 2 K / |U| = 1
and the radius that holds half of the mass, 1.3048, do not change. Each star is softened, which
takes the depth of close encounters away: -U is below 3 pi / 32 by about softening^2 / scale^2.
"""

import numpy as np

import particlesim as ps

frames = 100
settings = ps.Settings(dt=0.1, substeps=4, integrator="velocity_verlet", opening_angle=0.5)
HALF = (0.5 ** (-2 / 3) - 1) ** -0.5  # radius of half the mass, 1.3048


def build(count: int = 10_000, softening: float = 0.05, seed: int = 0) -> ps.Scene:
    """The cluster.

    Args:
        count: Stars.
        softening: Of each.
        seed: Of their places and velocities.
    """
    scene = ps.Scene(up_axis="z")
    x = ps.sample.plummer((0, 0, 0), 1.0, count, seed)
    v = ps.sample.plummer_velocity(x, (0, 0, 0), 1.0, seed=seed)
    scene.add_particles(
        x - x.mean(axis=0), velocity=v - v.mean(axis=0), mass=1.0 / count, radius=0.02,
        group="stars",
    )  # fmt: skip
    scene.add_interaction(ps.Gravity(G=1.0, softening=softening))
    return scene


def error(sim: ps.Simulation) -> float:
    """By which part the radius of half the mass is off."""
    x = sim.position - np.median(sim.position, axis=0)
    return abs(float(np.median(np.linalg.norm(x, axis=1))) / HALF - 1.0)
