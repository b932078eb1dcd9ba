"""A bridge of ropes and planks sags under a sack that falls on it, and comes to rest.

Then what its ropes pull at the posts with is the weight of all that hangs between them.
"""

import numpy as np

import particlesim as ps

frames = 240
settings = ps.Settings(dt=1 / 60, substeps=40, iterations=2)

GRAVITY, SPAN, WIDTH, RAIL = 9.81, 8.0, 1.2, 0.9  # [m/s^2], [m], [m], [m]
ROPE = 4e5  # EA [N]


def build(planks: int = 32, areal_density: float = 15.0, sack: float = 60.0) -> ps.Scene:
    """The bridge between its posts, a little longer than the gap, and the sack above it.

    Args:
        planks: Along the bridge.
        areal_density: Of the planks [kg/m^2].
        sack: Mass of the sack [kg].
    """
    scene = ps.Scene()
    scene.add_interaction(ps.UniformGravity((0, -GRAVITY, 0)))
    corner, sides = (-0.5 * SPAN, 0, -0.5 * WIDTH), [(SPAN, 0, 0), (0, 0, WIDTH)]
    vertices, triangles = ps.sample.rectangle(corner, sides, (planks, 4))
    # An arc to begin with, of which no rope is slack.
    vertices[:, 1] = -0.05 * SPAN * (1.0 - (2.0 * vertices[:, 0] / SPAN) ** 2)
    deck = scene.add_cloth(
        vertices, triangles[:, ::-1], areal_density=areal_density, stiffness=ROPE / WIDTH,
        radius=0.1, pinned=np.abs(vertices[:, 0]) > 0.4999 * SPAN, group="planks",
        color=(0.45, 0.3, 0.15),
    )  # fmt: skip
    for side, name in ((0, "left rail"), (4, "right rail")):
        below = deck.indices.reshape(-1, 5)[:, side]
        rail = scene.add_rope(
            scene.position[below] + (0, RAIL, 0), linear_density=2.0, stiffness=ROPE, radius=0.04,
            pinned=[0, -1], group=name, color=(0.55, 0.45, 0.3),
        )  # fmt: skip
        hangers = np.stack([rail.indices, below], axis=1)[1:-1]
        scene.add_constraint(ps.Distance(hangers, compliance=RAIL / ROPE, tension_only=True))
    damped = scene.groups[:]
    load = scene.add_particles(
        [(0.2, 0.3, 0.05)], mass=sack, radius=0.4, group="sack", color=(0.6, 0.55, 0.4)
    )
    # Creaking, and the straw in the sack: all slows down at about 2 a second.
    scene.add_interaction(ps.Drag(linear=4.0, group=damped))
    scene.add_interaction(ps.Drag(linear=2.0 * sack, group=load))
    scene.add_constraint(ps.Contact([deck.group, load], friction=0.6))
    return scene


def error(sim: ps.Simulation) -> float:
    """Part by which the posts' load is off the weight that hangs between them."""
    (scene,) = sim.scenes
    held, x = scene.pinned, sim.position
    load = 0.0
    for part in sim.constraints:
        if isinstance(part, ps.Distance):
            a, b = part.particles.T
            way = x[b] - x[a]
            pull = sim.force(part) * way[:, 1] / np.linalg.norm(way, axis=1)
            load += pull[held[b] & ~held[a]].sum() - pull[held[a] & ~held[b]].sum()
    return float(abs(load / (GRAVITY * scene.mass[~held].sum()) - 1.0))
