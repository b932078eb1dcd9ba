"""What recorders are tested with."""

import numpy as np

import particlesim as ps


def worlds():
    """Two worlds of two groups each, of different sizes."""
    scenes = []
    for count in (3, 2):
        scene = ps.Scene(periodic=((0, None, -1), (4, None, 1)))
        rng = np.random.default_rng(count)
        scene.add_particles(
            rng.uniform(0, 1, (count, 3)), velocity=rng.normal(size=(count, 3)), radius=0.1,
            mass=2.0, group="drops", charge=np.arange(1.0, 1.0 + count),
        )  # fmt: skip
        scene.add_particles([(0, 1, 0)], radius=0.3, group="stone", charge=-1.0)
        scene.add_interaction(ps.UniformGravity())
        scenes.append(scene)
    return scenes
