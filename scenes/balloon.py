"""A balloon is blown up, and rises until its string is taut.

The pressure in a sphere of tension T is 2 T / R (Young 1805, Laplace 1806); a skin of modulus Y, of
Poisson's ratio 1/3, that is stretched lambda times has T = 3/2 Y (lambda - 1) / lambda.
"""

import numpy as np

import particlesim as ps

frames = 240
settings = ps.Settings(dt=1 / 60, substeps=40, iterations=4)

RADIUS, SKIN = 0.15, 40.0  # slack [m], Y [N/m]
MASS, LIFT = 0.02, 0.3  # of the skin [kg], of the gas less its own weight [N]


def build(inflation: float = 1.5, subdivisions: int = 3, string: float = 0.5) -> ps.Scene:
    """A slack balloon on a string, with more gas than fits.

    Args:
        inflation: Volume of the gas over that of the slack balloon.
        subdivisions: Of the skin (see ``sample.icosphere``).
        string: Length of the string [m].
    """
    scene = ps.Scene()
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    vertices, triangles = ps.sample.icosphere((0, 0.6 * string + RADIUS, 0), RADIUS, subdivisions)
    area = 4 * np.pi * RADIUS**2
    skin = scene.add_cloth(
        vertices, triangles, areal_density=MASS / area, stiffness=SKIN, group="balloon",
        color=(0.8, 0.15, 0.2),
    )  # fmt: skip
    scene.add_constraint(ps.MeshVolume(skin.indices[triangles], inflation))
    scene.add_interaction(ps.ConstantForce((0, LIFT / len(vertices), 0), skin.group))
    lowest = int(np.argmin(vertices[:, 1]))
    line = np.linspace((0.4 * string, 0, 0), vertices[lowest], 21)[:-1]
    cord = scene.add_rope(
        line, linear_density=1e-3, radius=0.003, tension_only=True, pinned=[0], group="string",
        color=(0.9, 0.9, 0.85),
    )  # fmt: skip
    scene.add_constraint(ps.Distance([(cord.group[-1], skin.group[lowest])], tension_only=True))
    scene.add_interaction(ps.Drag(linear=2 * MASS / len(vertices), group=skin.group))
    scene.add_interaction(ps.Drag(linear=1e-4, group=cord.group))
    return scene


def error(sim: ps.Simulation) -> float:
    """Part by which the pressure is off that of Young and Laplace."""
    volume = next(part for part in sim.constraints if isinstance(part, ps.MeshVolume))
    stretch = float(volume.pressure[0]) ** (1 / 3)
    tension = 1.5 * SKIN * (stretch - 1) / stretch
    return abs(float(sim.force(volume)[0]) / (2 * tension / (stretch * RADIUS)) - 1)
