"""A toy star breathes: gas that a spring from its centre holds together (Monaghan and Price 2004).

P = rho^2 / 4 in a plane, and a pull of -r a unit of mass. At rest rho = 1 - r^2; drawn out by a
factor it swells and shrinks by that factor lambda(t) everywhere, lambda'' = 1 / lambda^3 - lambda,
at the frequency 2 however large it is.
"""

import numpy as np
import warp as wp

import particlesim as ps

frames = 99
settings = ps.Settings(dt=0.05, substeps=4, integrator="velocity_verlet")


@ps.law
def pull(position: wp.vec3, mass: float):
    return 0.5 * mass * wp.dot(position, position)


def build(count: int = 1000, speed: float = 0.2) -> ps.Scene:
    """The star at rest but for its swelling.

    Args:
        count: Particles, about.
        speed: At which its rim swells.
    """
    scene = ps.Scene(up_axis="z")
    x = ps.sample.box((-1, -1, 0), (1, 1, 0), (np.pi / count) ** 0.5)
    x = x[np.linalg.norm(x, axis=1) < 1.0]
    x = ps.sample.stretch(x, (0, 0, 0), 1.0, lambda r: 1 - r**2, dimension=2)
    spacing = (np.pi / len(x)) ** 0.5
    scene.add_particles(
        x, velocity=speed * x, mass=0.5 * np.pi / len(x), radius=0.4 * spacing, group="star"
    )  # fmt: skip
    scene.add_interaction(
        ps.SPH(
            smoothing_length=ps.AdaptiveSmoothing(2.0),
            equation_of_state=ps.Polytrope(0.25, 1.0),
            dimension=2,
        )
    )
    scene.add_interaction(ps.ParticleForce(potential=pull))
    return scene


def swelling(time: float, speed: float) -> float:
    """lambda: with e = (speed^2 + 2) / 2 its square is e + (1 - e) cos 2t + speed sin 2t."""
    e = 0.5 * speed**2 + 1.0
    return float((e + (1 - e) * np.cos(2 * time) + speed * np.sin(2 * time)) ** 0.5)


def error(sim: ps.Simulation) -> float:
    """By which part the size of the star is off, the root of the mean square of r."""
    (scene,) = sim.scenes
    x, v = scene.position, scene.velocity
    speed = float((x * v).sum() / (x * x).sum())
    size = ((sim.position**2).sum() / (x * x).sum()) ** 0.5
    return abs(float(size) / swelling(sim.time, speed) - 1.0)
