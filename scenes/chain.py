"""A chain of 200 links falls over two pegs, and snaps where it is pulled too hard."""

import numpy as np

import particlesim as ps

frames = 240
settings = ps.Settings(dt=1 / 60, substeps=40, iterations=4)


def build(
    links: int = 200,
    length: float = 0.02,
    mass: float = 0.01,
    weight: float = 1.5,
    strength: float = 60.0,
) -> ps.Scene:
    """A straight chain above two pegs, with a weight at either end.

    Args:
        links: Of the chain.
        length: Of a link [m].
        mass: Of a link [kg].
        weight: At each end [kg].
        strength: Force at which a link snaps [N].
    """
    span = links * length
    x = np.zeros((links + 1, 3))
    x[:, 0] = np.linspace(-span / 2, span / 2, links + 1)
    x[:, 1] = 0.35
    masses = np.full(links + 1, mass)
    masses[[0, -1]] = weight
    scene = ps.Scene()
    chain = scene.add_particles(x, mass=masses, radius=0.45 * length, group="chain")
    scene.add_particles(
        [(-0.25 * span, 0, 0), (0.2 * span, 0, 0)], radius=0.15, pinned=True, group="pegs"
    )
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    scene.add_interaction(ps.Drag(linear=0.002))
    pairs = np.stack([chain[:-1], chain[1:]], axis=1)
    scene.add_constraint(ps.Distance(pairs, compliance=1e-8, break_force=strength))
    scene.add_constraint(ps.Contact(friction=0.2))
    scene.add_constraint(ps.PlaneBoundary((0, -1.5, 0), (0, 1, 0), friction=0.5))
    return scene
