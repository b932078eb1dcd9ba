"""A block held together by distance constraints bounces on the ground."""

import numpy as np

import particlesim as ps
from particlesim.scenes.spring_lattice import NEAR, turned

frames = 180
settings = ps.Settings(dt=1 / 60, substeps=20, iterations=4)


def build(
    size: int = 5,
    spacing: float = 0.1,
    height: float = 0.8,
    restitution: float = 0.7,
    compliance: float = 1e-6,
    tilt: float = 0.4,
) -> ps.Scene:
    """A cube of size^3 particles, each kept at its distance from its 26 nearest.

    Args:
        size: Particles along an edge.
        spacing: Between neighbours [m].
        height: Of the lowest corner above the ground [m].
        restitution: Of the ground.
        compliance: Of the constraints [m/N].
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
    block = scene.add_particles(x, mass=0.02, radius=spacing / 2, group="block")
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    scene.add_constraint(ps.Distance(block[np.array(pairs)], compliance=compliance))
    scene.add_constraint(
        ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=0.3, restitution=restitution)
    )
    return scene
