"""A liquid between two plates that hold it fast: driven through (Poiseuille), or dragged (Couette).

From rest, in units of the gap, the viscosity and the speed of the flow in the end, a plane of fluid
that is periodic along the plates. Its speed is known at all times as a series (Morris et al. 1997).
"""

import numpy as np

import particlesim as ps

frames = 20
settings = ps.Settings(dt=0.05, substeps=70)

SOUND = 100.0  # speed of sound, in units of the fastest flow


def build(across: int = 20, dragged: bool = False) -> ps.Scene:
    """The liquid at rest.

    Args:
        across: Particles from plate to plate.
        dragged: The upper plate moves, at the speed 1; else a force drives the liquid, to that
            speed in the middle.
    """
    spacing = 1.0 / across
    length = 8 * spacing
    scene = ps.Scene(periodic=((0, None, None), (length, None, None)))
    x = ps.sample.box((0, 0, 0), (length, 1, 0), spacing)
    scene.add_particles(x, mass=spacing**2, radius=0.25 * spacing, group="liquid")
    scene.add_interaction(ps.UniformGravity((0.0 if dragged else 8.0, 0, 0)))
    scene.add_interaction(
        ps.SPH(
            smoothing_length=1.2 * spacing,
            smoothing="quintic_spline",
            rest_density=1.0,
            equation_of_state=ps.Tait(SOUND, negative_pressure=True),
            viscosity=ps.LaminarViscosity(1.0),
            dimension=2,
        )
    )
    speed = 1.0 if dragged else 0.0
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), slip=False))
    scene.add_constraint(
        ps.PlaneBoundary((0, 1, 0), (0, -1, 0), slip=False, velocity=(speed, 0, 0))
    )
    return scene


def speed(y: np.ndarray, time: float, dragged: bool) -> np.ndarray:
    """Of the liquid at these heights: the final flow less its Fourier series, which decays."""
    n = np.arange(1, 200)
    if dragged:
        final, weight = y, 2.0 / (n * np.pi) * np.where(n % 2, 1.0, -1.0)
    else:
        final, weight = 4 * y * (1 - y), np.where(n % 2, 32.0 / (n * np.pi) ** 3, 0.0)
    decay = weight * np.exp(-((n * np.pi) ** 2) * time)
    return final - np.sin(np.pi * np.multiply.outer(y, n)) @ decay


def error(sim: ps.Simulation) -> float:
    """The largest error of the speed, in parts of the fastest."""
    (scene,) = sim.scenes
    dragged = scene.constraints[1].moves
    exact = speed(sim.position[:, 1], sim.time, dragged)
    return float(np.abs(sim.velocity[:, 0] - exact).max())
