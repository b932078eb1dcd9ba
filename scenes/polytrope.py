"""A star comes to rest: gas that its own gravity holds together, a polytrope of index 1.

P = K rho^2 with K = 2 R^2 / pi, in units of the star's mass and radius and of G. Its density is
sin(pi r) / (4 r) (Lane and Emden), and a drag takes out what the start has too much.
"""

import numpy as np

import particlesim as ps

frames = 60
settings = ps.Settings(dt=0.5, substeps=20, integrator="velocity_verlet")


def build(count: int = 1000, eta: float = 1.2) -> ps.Scene:
    """The star, with nearly its density.

    Args:
        count: Particles, about.
        eta: Smoothing lengths, in spacings.
    """
    scene = ps.Scene(up_axis="z")
    spacing = (4 / 3 * np.pi / count) ** (1 / 3)
    x = ps.sample.sphere((0, 0, 0), 1.0, spacing)
    x = ps.sample.stretch(x, (0, 0, 0), 1.0, np.sinc)
    mass = 1.0 / len(x)
    scene.add_particles(x, mass=mass, radius=0.4 * spacing, group="star")
    scene.add_interaction(
        ps.SPH(
            smoothing_length=ps.AdaptiveSmoothing(eta), equation_of_state=ps.Polytrope(2 / np.pi, 1)
        )
    )
    scene.add_interaction(ps.Gravity(G=1.0, softening=0.3 * spacing))
    scene.add_interaction(ps.Drag(linear=4.0 * mass))
    return scene


def error(sim: ps.Simulation) -> float:
    """Of the density in the inner 0.8 of the radius: the root of its mean square, in parts."""
    r = np.linalg.norm(sim.position - sim.position.mean(axis=0), axis=1)
    inside = r < 0.8
    exact = np.pi / 4 * np.sinc(r[inside])
    return float(np.sqrt(np.mean((sim.get("density")[inside] / exact - 1) ** 2)))
