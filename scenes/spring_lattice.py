"""A block of springs falls, bounces on the ground and wobbles."""

import numpy as np

import particlesim as ps

frames = 180
settings = ps.Settings(dt=1 / 60, substeps=40)


def build(
    size: int = 8,
    spacing: float = 0.1,
    stiffness: float = 400.0,
    damping: float = 0.1,
    height: float = 0.6,
    tilt: float = 0.5,
) -> ps.Scene:
    """A cube of size^3 particles joined to their 26 nearest by springs.

    Args:
        size: Particles along an edge.
        spacing: Between neighbours [m].
        stiffness: Of a spring [N/m].
        damping: Of a spring [N s/m].
        height: Of the lowest corner above the ground [m].
        tilt: Turn about z and x [rad].
    """
    x = block(size, spacing, tilt)
    pairs = ps.sample.links(x, 1.8 * spacing)
    x[:, 1] += height - x[:, 1].min()
    scene = ps.Scene()
    cube = scene.add_particles(x, mass=0.01, radius=spacing / 2, group="block")
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    scene.add_interaction(ps.Springs(cube[pairs], stiffness, damping=damping))
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=0.3))
    return scene


def block(size: int, spacing: float, tilt: float) -> np.ndarray:
    """A cube of points about the origin, standing on an edge or a corner."""
    side = size * spacing / 2
    cube = ps.sample.box((-side,) * 3, (side,) * 3, spacing)
    return ps.sample.rotate(ps.sample.rotate(cube, (0, 0, 1), tilt), (1, 0, 0), tilt)
