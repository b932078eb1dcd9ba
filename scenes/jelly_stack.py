"""Cubes of jelly fall onto each other, wobble, and lie in a stack."""

import numpy as np

import particlesim as ps

frames = 180
settings = ps.Settings(dt=1 / 60, substeps=20, iterations=4)

SIDE = 0.3  # of a cube [m]


def build(
    cubes: int = 3,
    spacing: float = 0.075,
    youngs_modulus: float = 3e5,
    poissons_ratio: float = 0.4,
    damping: float = 0.01,
) -> ps.Scene:
    """The cubes one above the other.

    Args:
        cubes: How many.
        spacing: Of the lattice in them [m].
        youngs_modulus: Of the jelly [Pa]; softer columns bow under their own weight.
        poissons_ratio: Of the jelly.
        damping: Time in which its own wobbling is damped [s].
    """
    scene = ps.Scene()
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    corner = (-0.5 * SIDE, 0.0, -0.5 * SIDE)
    vertices, tetrahedra = ps.sample.box_tetrahedra(corner, (0.5 * SIDE, SIDE, 0.5 * SIDE), spacing)
    # Balls of the surface that touch, but for a gap that their own motion may close.
    radius = 0.45 * spacing
    for k in range(cubes):
        # Over the hollows of the one below.
        aside = 0.25 * spacing * (-1) ** k
        place = vertices + np.array([aside, radius + 1.35 * SIDE * k, aside])
        scene.add_soft_body(
            place, tetrahedra, density=1000.0, youngs_modulus=youngs_modulus,
            poissons_ratio=poissons_ratio, damping=damping, radius=radius, group=f"jelly {k}",
        )  # fmt: skip
    scene.add_constraint(ps.Contact(friction=0.6))
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=0.6))
    return scene
