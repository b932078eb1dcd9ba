"""A column of water at the end of a trough: at rest in one as wide, or breaking into another."""

from __future__ import annotations

import numpy as np
import warp as wp

import particlesim as ps

SPACING = 0.02  # [m]
SMOOTHING_LENGTH = SPACING  # support 2 h: 30 neighbours
SOUND_SPEED = 40.0  # [m/s], ten times sqrt(2 g H), the speed of a fall from the column's height
STEP = 0.3 * SMOOTHING_LENGTH / SOUND_SPEED
GRAVITY, VISCOSITY = 9.81, 0.05
SETTINGS = ps.Settings(dt=20 * STEP, substeps=20, execution="threads")


@ps.law
def walls(position: wp.vec3, mass: float, stiffness: float, length: float, width: float):
    """Springs against what lies outside of a trough, stiffness per mass."""
    low = wp.vec3(wp.min(position[0], 0.0), wp.min(position[1], 0.0), wp.min(position[2], 0.0))
    high = wp.vec3(wp.max(position[0] - length, 0.0), 0.0, wp.max(position[2] - width, 0.0))
    return -mass * stiffness * (low + high)


def places(side: int) -> np.ndarray:
    """Of the ``side`` cubed particles, (n, 3)."""
    return ps.sample.box((0, 0, 0), (side * SPACING,) * 3, SPACING, jitter=0.05)


def water(side: int, length: float = 1.0) -> ps.Scene:
    """The scene; ``length`` of the trough, in columns."""
    scene = ps.Scene()
    width = side * SPACING
    fluid = scene.add_particles(places(side), mass=1000.0 * SPACING**3)
    scene.add_interaction(ps.UniformGravity((0.0, -GRAVITY, 0.0)))
    scene.add_interaction(
        ps.ParticleForce(walls, stiffness=0.05 / STEP**2, length=length * width, width=width)
    )
    scene.add_interaction(
        ps.SPH(
            fluid,
            smoothing_length=SMOOTHING_LENGTH,
            rest_density=1000.0,
            equation_of_state=ps.Tait(SOUND_SPEED),
            smoothing="cubic_spline",
            viscosity=ps.ArtificialViscosity(VISCOSITY),
        )
    )
    return scene


def flowing(side: int, length: float, start: float, threads: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities after a time [s], by our own program for everybody."""
    sim = ps.Simulation(water(side, length), SETTINGS.replace(threads=threads), device="cpu")
    sim.run(round(start / SETTINGS.dt))
    return sim.get("position"), sim.get("velocity")


def answers(x: np.ndarray) -> dict[str, float]:
    """Mean height, and how far all but a hundredth have come [m]."""
    return {"height": float(x[:, 1].mean()), "front": float(np.quantile(x[:, 0], 0.99))}
