"""A block of springs falls, bounces on the ground and wobbles."""

import itertools

import numpy as np

import particlesim as ps

frames = 180
settings = ps.Settings(dt=1 / 60, substeps=40)

NEAR = [d for d in itertools.product((-1, 0, 1), repeat=3) if d > (0, 0, 0)]


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
    cells = np.stack(np.meshgrid(*[np.arange(size)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    index = {tuple(c): k for k, c in enumerate(cells.tolist())}
    pairs = [
        (k, index[other])
        for c, k in index.items()
        for d in NEAR
        if (other := (c[0] + d[0], c[1] + d[1], c[2] + d[2])) in index
    ]
    x = turned((cells - (size - 1) / 2) * spacing, tilt)
    x[:, 1] += height - x[:, 1].min()
    scene = ps.Scene()
    block = scene.add_particles(x, mass=0.01, radius=spacing / 2, group="block")
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    scene.add_interaction(ps.Springs(block[np.array(pairs)], stiffness, damping=damping))
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=0.3))
    return scene


def turned(x: np.ndarray, angle: float) -> np.ndarray:
    """Points turned about z, then about x."""
    c, s = np.cos(angle), np.sin(angle)
    about_z = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    about_x = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    return x @ (about_x @ about_z).T
