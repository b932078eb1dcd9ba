"""Water sloshes between two walls as a standing wave, to and fro by its own weight.

A plane of water 1 deep and half a wave wide. Linear theory: omega^2 = g k tanh(k H), and the flow
is that of a potential cos(k x) cosh(k (y + H)) below the surface y = 0. It starts level and in
motion, under the pressure of the weight above.
"""

import numpy as np

import particlesim as ps

GRAVITY, DEPTH = 9.81, 1.0
DENSITY, SPEED = 1000.0, 4.5  # at rest [kg/m^3], of a fall over the depth [m/s]

frames = 60
settings = ps.Settings(dt=0.02, substeps=75)


def build(
    length: float = 1.0, spacing: float = 1 / 48, speed: float = 0.2,
    density: ps.ContinuityDensity | None = None,
) -> ps.Scene:  # fmt: skip
    """The water, level.

    Args:
        length: Of the wave [m].
        spacing: Of the particles [m].
        speed: Of the surface at the walls [m/s].
        density: By continuity; None: summed.
    """
    scene = ps.Scene()
    scene.add_interaction(ps.UniformGravity((0, -GRAVITY, 0)))
    x = ps.sample.box((0, -DEPTH, 0), (length / 2, 0, 0), spacing)
    scene.add_fluid(
        x,
        spacing=spacing,
        rest_density=DENSITY,
        speed=SPEED,
        hydrostatic=True,
        velocity=speed * flow(x, length),
        smoothing_length=2 * spacing,
        viscosity=ps.ArtificialViscosity(0.01),
        density=density,
        dimension=2,
        group="water",
    )
    sides = (0, -DEPTH, -np.inf), (length / 2, DEPTH, np.inf)
    scene.add_constraint(ps.BoxBoundary(*sides))
    return scene


def flow(x: np.ndarray, length: float) -> np.ndarray:
    """Velocities of the wave, 1 upwards at the surface at the left wall."""
    k = 2 * np.pi / length
    a, b = k * x[:, 0], k * (x[:, 1] + DEPTH)
    v = np.stack([-np.sin(a) * np.cosh(b), np.cos(a) * np.sinh(b), 0 * a], axis=1)
    return v / np.sinh(k * DEPTH)


def period(length: float) -> float:
    """Of the wave [s]."""
    k = 2 * np.pi / length
    return 2 * np.pi / (GRAVITY * k * np.tanh(k * DEPTH)) ** 0.5


def amplitude(sim: ps.Simulation) -> float:
    """How much of the wave is in the motion: 1 at the start, and -1 half a period later."""
    (scene,) = sim.scenes
    start = scene.velocity
    return float((sim.velocity * start).sum() / (start**2).sum())


def error(sim: ps.Simulation) -> float:
    """By how much that is off."""
    (scene,) = sim.scenes
    length = 2.0 * scene.constraints[0].upper[0]
    return float(abs(amplitude(sim) - np.cos(2 * np.pi * sim.time / period(length))))
