"""A gas of spheres forgets that all of them started with the same speed.

Soft spheres collide in a closed box; collisions turn one speed into Maxwell-Boltzmann's
distribution, whose velocity components have kurtosis 3 (one speed in all directions: 9/5).
"""

import numpy as np
import warp as wp

import particlesim as ps

frames = 240
settings = ps.Settings(dt=1 / 60, substeps=80)


@ps.law
def sphere(r: float, stiffness: float, diameter: float):
    """Energy of two elastic spheres pressed together, as by a linear spring."""
    overlap = wp.where(r < diameter, diameter - r, 0.0)
    return 0.5 * stiffness * overlap * overlap


def build(
    count: int = 2000,
    speed: float = 2.0,
    diameter: float = 0.04,
    stiffness: float = 500.0,
    seed: int = 0,
) -> ps.Scene:
    """Spheres of mass 0.001 in a unit box.

    Args:
        count: Spheres.
        speed: At the start, of every sphere [m/s].
        diameter: [m].
        stiffness: Of two spheres in contact [N/m].
        seed: Of positions and directions.
    """
    rng = np.random.default_rng(seed)
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    inside = np.full(3, diameter / 2)
    scene = ps.Scene()
    gas = scene.add_particles(
        ps.sample.random(inside, 1 - inside, count, seed=seed, minimum_distance=diameter),
        velocity=speed * direction,
        mass=0.001,
        radius=diameter / 2,
        group="gas",
    )
    scene.add_interaction(
        ps.PairPotential(sphere, gas, cutoff=diameter, stiffness=stiffness, diameter=diameter)
    )
    scene.add_constraint(ps.BoxBoundary((0, 0, 0), (1, 1, 1), restitution=1.0))
    return scene


def error(sim: ps.Simulation) -> float:
    """Distance of the kurtosis of the velocity components from 3."""
    v = sim.velocity.ravel()
    return abs(float((v**4).mean() / (v**2).mean() ** 2) - 3.0)
