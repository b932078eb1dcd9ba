"""A round drop of liquid without weight is drawn out to an ellipse (Monaghan 1994).

In a plane, in units of the drop's radius, its density and the rate at which it is drawn out at the
start, v = (-x, y). An incompressible drop stays an ellipse, whose axes are those of an ordinary
differential equation.
"""

import numpy as np

import particlesim as ps

frames = 19
settings = ps.Settings(dt=0.04, substeps=60)

SOUND = 14.0  # speed of sound


def build(
    across: int = 60, viscosity: float = 0.02, density: ps.ContinuityDensity | None = None
) -> ps.Scene:
    """The drop while it is round.

    Args:
        across: Particles across the drop.
        viscosity: Artificial viscosity, alpha.
        density: By continuity; None: summed.
    """
    spacing = 2.0 / across
    scene = ps.Scene(up_axis="z")
    x = ps.sample.box((-1, -1, 0), (1, 1, 0), spacing)
    x = x[np.linalg.norm(x, axis=1) < 1.0]
    mass = np.pi / len(x)
    scene.add_particles(
        x, velocity=x * [-1.0, 1.0, 0.0], mass=mass, radius=0.5 * spacing, group="drop"
    )  # fmt: skip
    scene.add_interaction(
        ps.SPH(
            smoothing_length=2 * spacing,
            rest_density=mass / spacing**2,
            equation_of_state=ps.Tait(SOUND),
            viscosity=ps.ArtificialViscosity(viscosity),
            density=density,
            dimension=2,
        )
    )
    return scene


def axes(time: float) -> tuple[float, float]:
    """Half the width and half the height of the drop: a' = -A a, A' = A^2 (a^4 - 1) / (a^4 + 1)

    (Monaghan 1994), by Runge and Kutta's method of fourth order.
    """

    def rate(state: np.ndarray) -> np.ndarray:
        a, pull = state
        return np.array([-pull * a, pull**2 * (a**4 - 1) / (a**4 + 1)])

    state, steps = np.array([1.0, 1.0]), 1000
    dt = time / steps
    for _ in range(steps):
        k1 = rate(state)
        k2 = rate(state + 0.5 * dt * k1)
        k3 = rate(state + 0.5 * dt * k2)
        k4 = rate(state + dt * k3)
        state = state + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return float(state[0]), float(1 / state[0])


def error(sim: ps.Simulation) -> float:
    """The larger error of both axes, in parts of them; an ellipse's second moments are a^2 / 4."""
    found = 2.0 * sim.position[:, :2].std(axis=0)
    start = 2.0 * sim.scenes[0].position[:, :2].std(axis=0)  # of squares at the rim: not quite 1
    return float(np.abs(found / (start * axes(sim.time)) - 1.0).max())
