"""Two polytropic stars collide and merge.

Units of one star's mass and radius, G = 1. Each star is at first a polytrope of index 1,
P = K rho^2 with K = 2 R^2 / pi, whose density is sin(pi r) / (4 r) (Lane-Emden); SPH holds it
against its gravity, with smoothing lengths that follow the density. The gas has gamma = 2, so that
it stays one where nothing heats it, and where the stars meet shocks turn motion into heat.
"""

import numpy as np

import particlesim as ps

frames = 200
settings = ps.Settings(dt=0.05, substeps=10, integrator="velocity_verlet")


def build(
    count: int = 1200, separation: float = 3.0, impact: float = 0.6, speed: float = 0.45
) -> ps.Scene:
    """Two stars on their way towards each other.

    Args:
        count: Particles of a star, about.
        separation: Of the centres along x.
        impact: Of the centres along y.
        speed: Of each star along x.
    """
    scene = ps.Scene(up_axis="z")
    ball = star(count)
    for side, name in ((-1.0, "left"), (1.0, "right")):
        scene.add_particles(
            ball + np.array([side * separation / 2, side * impact / 2, 0.0]),
            velocity=(-side * speed, 0, 0),
            mass=1.0 / len(ball),
            internal_energy=0.5 * np.sinc(np.linalg.norm(ball, axis=1)),  # K rho
            radius=0.5 * len(ball) ** (-1 / 3),
            group=name,
        )
    scene.add_interaction(
        ps.SPH(
            smoothing_length=ps.AdaptiveSmoothing(1.2),
            equation_of_state=ps.IdealGas(2.0),
            smoothing="cubic_spline",
            viscosity=ps.ArtificialViscosity(1.0, 2.0),
        )
    )
    scene.add_interaction(ps.Gravity(G=1.0, softening=len(ball) ** (-1 / 3)))
    return scene


def star(count: int) -> np.ndarray:
    """Points of equal mass with the density of a polytrope of index 1, in the unit ball."""
    spacing = (4 / 3 * np.pi / count) ** (1 / 3)
    ball = ps.sample.sphere((0, 0, 0), 1.0, spacing)
    return ps.sample.stretch(ball, (0, 0, 0), 1.0, lambda r: np.sinc(r))
