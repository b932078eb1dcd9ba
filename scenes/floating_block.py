"""A block of wood floats in a tank of water, as deep as Archimedes says.

A plane. The block is a cluster of particles that rigid distances hold together, and one of two
fluids for the water, which presses on its particles as on its own: whatever holds particles
together may swim. It is let go above its depth, and bobs.
"""

import numpy as np

import particlesim as ps

frames = 240
settings = ps.Settings(dt=1 / 60, substeps=48, iterations=4)

GRAVITY, WATER = 9.81, 1000.0  # [m/s^2], [kg/m^3]
WIDTH, HEIGHT = 0.4, 0.2  # of the block [m]
TANK, DEPTH = 1.2, 0.4  # the tank's width, and the water's depth without the block [m]
SOUND = 35.0  # speed of sound [m/s]


def build(spacing: float = 0.02, density: float = 500.0, lifted: float = 0.02) -> ps.Scene:
    """The block on its way down.

    Args:
        spacing: Of the particles [m].
        density: Of the block [kg/m^3].
        lifted: By how much it starts above the depth at which it floats [m].
    """
    draught = density / WATER * HEIGHT
    level = DEPTH + draught * WIDTH / TANK
    bottom = level - draught + lifted
    left = (TANK - WIDTH) / 2
    x = ps.sample.box((0, 0, 0), (TANK, level, 0), spacing)
    hole = (np.abs(x[:, 0] - TANK / 2) < WIDTH / 2) & (x[:, 1] > bottom)
    scene = ps.Scene()
    water = scene.add_particles(
        x[~hole], mass=WATER * spacing**2, radius=0.4 * spacing, group="water"
    )  # fmt: skip
    block = ps.sample.box((left, bottom, 0), (left + WIDTH, bottom + HEIGHT, 0), spacing)
    wood = scene.add_particles(
        block, mass=density * spacing**2, radius=0.5 * spacing, group="wood",
        color=(0.6, 0.4, 0.2),
    )  # fmt: skip
    scene.add_interaction(ps.UniformGravity((0, -GRAVITY, 0)))
    scene.add_interaction(
        ps.SPH(
            [water, wood],
            smoothing_length=1.6 * spacing,
            rest_density=[WATER, density],
            equation_of_state=ps.Tait(SOUND),
            viscosity=ps.ArtificialViscosity(0.1),
            dimension=2,
        )
    )
    scene.add_constraint(ps.Distance(ps.sample.links(block, 1.5 * spacing) + wood.start))
    sides = (0, 0, -np.inf), (TANK, 3 * DEPTH, np.inf)
    scene.add_constraint(ps.BoxBoundary(*sides))
    return scene


def draught(sim: ps.Simulation) -> float:
    """How deep the block is in the water [m], by where its middle is and how much water there is.

    The water covers the tank up to a level z, but for the block: TANK z - WIDTH draught.
    """
    (scene,) = sim.scenes
    water, wood = scene.groups
    bottom = float(sim.position[wood.slice, 1].mean()) - HEIGHT / 2
    area = float(scene.mass[water.slice].sum()) / WATER
    return (area / TANK - bottom) / (1 - WIDTH / TANK)


def error(sim: ps.Simulation) -> float:
    """By which part that is off, once the block has come to rest."""
    (scene,) = sim.scenes
    _, wood = scene.groups
    displaced = float(scene.mass[wood.slice].sum()) / WATER
    return abs(draught(sim) * WIDTH / displaced - 1.0)
