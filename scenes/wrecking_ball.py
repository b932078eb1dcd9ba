"""A heavy ball swings on its cable into a wall of bricks that lie on each other."""

import numpy as np

import particlesim as ps

frames = 240
settings = ps.Settings(dt=1 / 60, substeps=20, iterations=4)

SPACING = 0.1  # of the balls that bricks are made of [m]
LENGTH = 3.0  # of the cable [m]


def build(
    rows: int = 8, columns: int = 6, ball: float = 400.0, angle: float = 55.0, friction: float = 0.5
) -> ps.Scene:
    """The wall on the floor, and the ball held aside.

    Args:
        rows: Of bricks, one on the other.
        columns: Of bricks in a row.
        ball: Mass of the ball [kg].
        angle: At which it is let go, from hanging straight down [degrees].
        friction: Between the bricks, the ball and the floor.
    """
    scene = ps.Scene()
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    bricks = []
    brick = ps.sample.box((0, 0, -0.2), (0.2, 0.2, 0.2), SPACING)
    layer = SPACING * (1 + np.sqrt(0.5))  # a ball lies in the hollow of four
    for row, column in np.ndindex(rows, columns):
        # Half a brick and half a ball on in each other row.
        odd = row % 2
        at = (0.5 * SPACING * odd, layer * row, (column - 0.5 * columns) * 0.4 + 0.15 * odd)
        body = scene.add_rigid_body(
            brick + at, spacing=SPACING, density=1800.0, group=f"brick {row} {column}",
            color=(0.6, 0.25 + 0.05 * (column % 2), 0.15 + 0.08 * odd),
        )  # fmt: skip
        bricks.append(body.group)
    # At the lowest it hangs in front of the upper half of the wall.
    post = np.array([-0.45, 0.6 * rows * layer + LENGTH, 0.0])
    swing = np.radians(angle)
    place = post + LENGTH * np.array([-np.sin(swing), -np.cos(swing), 0.0])
    load = scene.add_particles(
        [place], mass=ball, radius=0.35, group="ball", color=(0.2, 0.2, 0.22)
    )
    line = ps.sample.curve([post, post + (1 - 0.35 / LENGTH) * (place - post)], 0.15)
    cable = scene.add_rope(
        line, linear_density=4.0, radius=0.03, pinned=[0], group="cable", color=(0.3, 0.3, 0.3)
    )
    scene.add_constraint(ps.Distance([(cable.group[-1], load[0])]))
    scene.add_constraint(ps.Contact([*bricks, load], friction=friction))
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=friction))
    return scene
