"""Water at rest in a tank: the floor bears its weight, p = rho g h.

The fluid comes from one call, which finds masses, sound and the pressure of every depth; the box
mirrors it. What the start is off by goes as sound, 4 h / c long, which viscosity quiets. The error
is that of the pressure on the floor.
"""

import numpy as np

import particlesim as ps

GRAVITY, DENSITY = 9.81, 1000.0
PLACES = 7  # along each side of the floor, where the pressure is read

frames = 90
settings = ps.Settings(dt=1 / 30, substeps=40)


def build(
    depth: float = 1.0,
    width: float = 0.5,
    spacing: float = 0.05,
    viscosity: float = 0.3,
    hydrostatic: bool = True,
) -> ps.Scene:
    """Water in a tank that is half as high again.

    Args:
        depth: Of the water, h [m].
        width: Of the square floor [m].
        spacing: Of the particles [m].
        viscosity: Artificial viscosity, alpha.
        hydrostatic: Start under the pressure of the depth; False: it falls into that.
    """
    scene = ps.Scene()
    scene.add_interaction(ps.UniformGravity((0, -GRAVITY, 0)))
    scene.add_fluid(
        [(0, 0, 0), (width, depth, width)], spacing=spacing, rest_density=DENSITY,
        hydrostatic=hydrostatic, viscosity=ps.ArtificialViscosity(viscosity), group="water",
    )  # fmt: skip
    scene.add_constraint(ps.BoxBoundary((0, 0, 0), (width, 1.5 * depth, width)))
    return scene


def floor_pressure(sim: ps.Simulation) -> float:
    """Mean pressure on the floor, over rho g h of the start."""
    _, fluid = sim.scenes[0].interactions
    x = sim.scenes[0].position
    width, depth = (float(x[:, axis].max() + x[:, axis].min()) for axis in (0, 1))
    along = np.linspace(0.2, 0.8, PLACES) * width
    places = [(a, 0.0, b) for a in along for b in along]
    pressure = sim.interpolate(fluid, places, "pressure", normalized=True)
    return float(pressure.mean()) / (DENSITY * GRAVITY * depth)


def error(sim: ps.Simulation) -> float:
    """By how much the pressure on the floor is off, in parts of it, at the present time."""
    return abs(floor_pressure(sim) - 1.0)
