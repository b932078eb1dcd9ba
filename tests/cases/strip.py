"""A strip of cloth that tears in the middle at once."""

import numpy as np

import particlesim as ps


def strip():
    """Three squares of two triangles that hang by the upper edge; and which links do not bear it.

    The sides of the middle square do not hold the lowest.
    """
    vertices, triangles = ps.sample.rectangle((0, 0, 0), [(1, 0, 0), (0, -3, 0)], cells=(1, 3))
    height = vertices[ps.sample.edges(triangles)][:, :, 1]
    weak = (height == -1).any(axis=1) & (height == -2).any(axis=1)
    scene = ps.Scene()
    scene.add_interaction(ps.UniformGravity((0, -10, 0)))
    scene.add_cloth(
        vertices, triangles, areal_density=1.0, pinned=np.flatnonzero(vertices[:, 1] == 0),
        break_force=np.where(weak, 1.0, 1e6), group="strip",
    )  # fmt: skip
    return scene, weak


def squares(triangles):
    """The numbers of the squares that triangles are of, from above, in order."""
    vertices, _ = ps.sample.rectangle((0, 0, 0), [(1, 0, 0), (0, -3, 0)], cells=(1, 3))
    return sorted(np.floor(-vertices[triangles].mean(axis=1)[:, 1]).astype(int).tolist())
