"""A clamped rod bends under a weight at its tip, by F L^3 / (3 EI) (Bernoulli and Euler, 1750).

Steel, 1 m long and 4 mm thick: its own weight adds rho A g L^4 / (8 EI).
"""

import numpy as np

import particlesim as ps

frames = 180
settings = ps.Settings(dt=1 / 60, substeps=400, precision="float64")

GRAVITY = 9.81  # [m/s^2]
LENGTH, RADIUS = 1.0, 0.002  # [m]
YOUNG, DENSITY = 200e9, 7850.0  # [Pa], [kg/m^3]
AREA = np.pi * RADIUS**2
BENDING, STRETCH = YOUNG * np.pi / 4 * RADIUS**4, YOUNG * AREA  # EI [N m^2], EA [N]


def build(links: int = 12, load: float = 0.02) -> ps.Scene:
    """A rod that is let go as it sticks out of a wall, in oil that brings it to rest.

    Args:
        links: Of the rod.
        load: Mass at the tip [kg].
    """
    scene = ps.Scene()
    link = LENGTH / links
    line = np.zeros((links + 2, 3))
    # The first two are in the wall, close together: they hold the direction.
    line[:, 0] = np.append(-0.01 * link, np.linspace(0.0, LENGTH, links + 1))
    rod = scene.add_rope(
        line, linear_density=DENSITY * AREA, radius=2 * RADIUS, stiffness=STRETCH,
        bending_stiffness=BENDING, pinned=[0, 1], group="rod",
    )  # fmt: skip
    scene.add_interaction(ps.UniformGravity((0, -GRAVITY, 0)))
    scene.add_interaction(ps.ConstantForce((0, -load * GRAVITY, 0), rod.indices[-1:]))
    scene.add_interaction(ps.Drag(linear=10 * DENSITY * AREA * link))
    return scene


def error(sim: ps.Simulation) -> float:
    """Part by which the tip is off the height of beam theory."""
    load = -sim.scenes[0].interactions[1].parameters["force"][1]
    own = DENSITY * AREA * GRAVITY
    sag = load * LENGTH**3 / (3 * BENDING) + own * LENGTH**4 / (8 * BENDING)
    return float(abs(-sim.position[-1, 1] / sag - 1.0))
