"""A column of water collapses in a tank (Martin and Moyce 1952).

Weakly compressible SPH: Tait's equation of state with ten times the fastest speed as the speed of
sound. A column ``width`` wide and twice as high. The error is that of the front's place against the
experiment, while it is still on its way.
"""

import numpy as np

import particlesim as ps

frames = 120
settings = ps.Settings(dt=1 / 60, substeps=24)

# t sqrt(2 g / a) and the front's z / a, column a wide and 2 a high.
MARTIN_MOYCE = np.array(
    [(1.219, 1.474), (1.997, 2.292), (2.547, 2.995), (3.345, 4.134), (4.034, 4.944)]
)
GRAVITY = 9.81


def build(
    width: float = 0.5,
    depth: float = 0.3,
    spacing: float = 0.025,
    tank: float = 2.5,
    viscosity: float = 0.05,
    seed: int = 0,
    density: ps.ContinuityDensity | None = None,
) -> ps.Scene:
    """Water in the left of a tank.

    Args:
        width: Of the column [m]; it is twice as high.
        depth: Of the tank, front to back [m].
        spacing: Of the particles [m].
        tank: Length of the tank [m].
        viscosity: Artificial viscosity, alpha.
        seed: Of how the water stirs at first, by a thousandth of the fastest speed.
        density: By continuity; None: summed.
    """
    height = 2 * width
    fastest = np.sqrt(2 * GRAVITY * height)
    scene = ps.Scene()
    column = ps.sample.box((0, 0, 0), (width, height, depth), spacing)
    stir = np.random.default_rng(seed).normal(0.0, 1e-3 * fastest, column.shape)
    water = scene.add_particles(
        column, velocity=stir, mass=1000.0 * spacing**3, radius=spacing / 2, group="water"
    )
    scene.add_interaction(ps.UniformGravity((0, -GRAVITY, 0)))
    scene.add_interaction(
        ps.SPH(
            water,
            smoothing_length=1.3 * spacing,
            rest_density=1000.0,
            equation_of_state=ps.Tait(sound_speed=10 * fastest),
            smoothing="wendland_c2",
            viscosity=ps.ArtificialViscosity(viscosity),
            density=density,
        )
    )
    scene.add_constraint(ps.BoxBoundary((0, 0, 0), (tank, 1.3 * height, depth), slip=False))
    return scene


def error(sim: ps.Simulation) -> float:
    """Front against experiment at the present time, in parts of the way; nan outside the data.

    The front is as far as all but 1 in 500 drops have come: single ones fly ahead.
    """
    x = sim.scenes[0].position
    width = float(np.ptp(x[:, 1]) / 2)
    when = sim.time * np.sqrt(2 * GRAVITY / width)
    times, places = MARTIN_MOYCE.T
    if not times[0] <= when <= times[-1]:
        return float("nan")
    front = float(np.quantile(sim.position[:, 0], 0.998)) / width
    return abs(front / float(np.interp(when, times, places)) - 1.0)
