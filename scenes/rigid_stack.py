"""Ten boxes stand on each other, each a rigid body of balls that lie in the hollows below."""

import numpy as np

import particlesim as ps

frames = 600
settings = ps.Settings(dt=1 / 60, substeps=20, iterations=4)

SIDE, SPACING = 0.4, 0.1  # of a box, and of its balls [m]


def build(boxes: int = 10, density: float = 800.0, friction: float = 0.5) -> ps.Scene:
    """The stack on the floor.

    Args:
        boxes: One on the other.
        density: Of the boxes [kg/m^3].
        friction: Between them and on the floor.
    """
    scene = ps.Scene()
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    height = 0.2 + SPACING * np.sqrt(0.5)  # from one box to the next
    for k in range(boxes):
        aside = 0.25 * SPACING * (-1) ** k  # a ball over the middle of four
        low = np.array([aside - 0.5 * SIDE, k * height, aside - 0.5 * SIDE])
        box = ps.sample.box(low, low + np.array([SIDE, 0.3, SIDE]), SPACING)
        scene.add_rigid_body(box, spacing=SPACING, density=density)
    scene.add_constraint(ps.Contact(friction=friction))
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=friction))
    return scene


def error(sim: ps.Simulation) -> float:
    """How far any ball has gone aside, in sides of a box."""
    way = (sim.position - sim.scenes[0].position)[:, [0, 2]]
    return float(np.linalg.norm(way, axis=1).max()) / SIDE
