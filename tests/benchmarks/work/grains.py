"""Grains that fall from a loose block onto the ground, and settle."""

from __future__ import annotations

import numpy as np

import particlesim as ps

RADIUS = 0.05  # [m]
GRAVITY = 9.81
SETTINGS = ps.Settings(dt=1 / 60, substeps=20, execution="threads")


def places(side: int) -> np.ndarray:
    """Where the ``side`` cubed grains start, (n, 3)."""
    rng = np.random.default_rng(0)
    x = ps.sample.lattice("sc", (side,) * 3, 2.05 * RADIUS) + RADIUS
    return x + rng.uniform(-0.02, 0.02, x.shape) * RADIUS


def block(side: int, friction: float, boulder: float = 0.0) -> ps.Scene:
    """The scene.

    Args:
        side: Grains along an edge.
        friction: Between grains, and with the ground.
        boulder: Radius of a heavy sphere far beside the block, in radii of a grain; 0: none.
    """
    scene = ps.Scene()
    scene.add_particles(places(side), radius=RADIUS)
    if boulder:
        R = boulder * RADIUS
        beside = -R - 2 * RADIUS  # touches the first grains as they spread
        scene.add_particles([(beside, R, side * RADIUS)], radius=R, mass=boulder**3)
    scene.add_interaction(ps.UniformGravity((0, -GRAVITY, 0)))
    scene.add_constraint(ps.Contact(friction=friction))
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=friction))
    return scene


def height(side: int):
    """What a simulation says of how high its ``side`` cubed grains lie on average [m]."""
    return lambda sim: {"height": float(sim.position[: side**3, 1].mean())}
