"""300 grains of very different mass fall into a pile."""

import numpy as np

import particlesim as ps

frames = 240
settings = ps.Settings(dt=1 / 60, substeps=20, iterations=4)


def build(count: int = 300, friction: float = 0.4, seed: int = 0) -> ps.Scene:
    """Grains of 4 to 8 cm, the largest eight times as heavy as the smallest, in an open box.

    Args:
        count: Grains.
        friction: Of grains and walls.
        seed: Of sizes and places.
    """
    rng = np.random.default_rng(seed)
    radius = rng.uniform(0.02, 0.04, count)
    layers = max(0.5, 0.006 * count)
    scene = ps.Scene()
    scene.add_particles(
        ps.sample.random(
            (-0.25, 0.1, -0.25), (0.25, 0.1 + layers, 0.25), count, seed=seed,
            minimum_distance=0.075,
        ),
        mass=2500.0 * 4 / 3 * np.pi * radius**3,
        radius=radius,
        group="grains",
    )  # fmt: skip
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    scene.add_constraint(ps.Contact(friction=friction))
    scene.add_constraint(ps.BoxBoundary((-0.6, 0, -0.6), (0.6, np.inf, 0.6), friction=friction))
    return scene
