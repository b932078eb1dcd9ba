"""A table cloth falls over a ball and hangs from it in folds."""

import numpy as np

import particlesim as ps

frames = 150
settings = ps.Settings(dt=1 / 60, substeps=20)

RADIUS = 0.35  # of the ball [m]


def build(
    side: float = 1.4,
    cells: int = 56,
    areal_density: float = 0.15,
    stiffness: float = 1e3,
    bending: float = 1e-4,
    friction: float = 0.4,
) -> ps.Scene:
    """A square cloth, level above a ball that stands on the floor.

    Args:
        side: Of the cloth [m].
        cells: Along each side.
        areal_density: [kg/m^2].
        stiffness: Young's modulus times the thickness [N/m].
        bending: Bending stiffness, as of a woollen cloth [J].
        friction: Of the cloth on the ball and the floor.
    """
    scene = ps.Scene()
    # A little aside and askew, so that no fold is the mirror image of another.
    corner, turn = np.array([-0.5 * side + 0.03, 2.2 * RADIUS, -0.5 * side + 0.02]), 0.1
    first = side * np.array([np.sin(turn), 0.0, np.cos(turn)])
    second = side * np.array([np.cos(turn), 0.0, -np.sin(turn)])
    scene.add_cloth(
        *ps.sample.rectangle(corner, (first, second), cells), areal_density=areal_density,
        stiffness=stiffness, bending_stiffness=bending, radius=0.005, group="cloth",
        color=(0.7, 0.2, 0.15),
    )  # fmt: skip
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    scene.add_interaction(ps.Drag(linear=0.5 * areal_density * (side / cells) ** 2))
    ball = {"friction": friction, "inside": False}
    scene.add_constraint(ps.SphereBoundary((0, RADIUS, 0), RADIUS, **ball))
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=friction))
    return scene
