"""A blast: energy set free at a point of a cold gas drives a sphere of shock before it.

Sedov's solution (1959), in units of the gas's density, the energy and half the cube's side: the
shock is at R = xi (E t^2 / rho)^(1/5), with xi = 1.151666 for gamma = 5/3, and thins the middle out
to nothing. SPH with smoothing lengths that follow the density; the energy starts in the few
particles that one in the middle reaches.
"""

import numpy as np

import particlesim as ps

GAMMA, XI = 5.0 / 3.0, 1.151666  # in three dimensions
MOMENT = 0.668459  # 4 pi (int G s^3 ds - 1/4), G(s = r / R) being the density behind the shock
COLD = 1e-6  # of the energy is in the gas before

frames = 20
settings = ps.Settings(dt=0.02, substeps=32, integrator="velocity_verlet")


def build(side: int = 24, eta: float = 1.2, spread: float = 1.0) -> ps.Scene:
    """A cube of gas, too cold to move by itself, with the energy 1 in the middle.

    Args:
        side: Particles along a side of the cube.
        eta: Smoothing lengths, in spacings.
        spread: Smoothing length that the energy is spread with, in those of the particles.
    """
    scene = ps.Scene()
    spacing = 2.0 / side
    x = ps.sample.box((-1, -1, -1), (1, 1, 1), spacing)
    q = np.linalg.norm(x, axis=1) / (spread * eta * spacing)
    share = np.maximum(1 - q / 2, 0) ** 4 * (1 + 2 * q)
    mass = spacing**3
    scene.add_particles(
        x, mass=mass, radius=0.5 * spacing, group="gas",
        internal_energy=share / (share.sum() * mass) + COLD / (mass * len(x)),
    )  # fmt: skip
    scene.add_interaction(
        ps.SPH(
            smoothing_length=ps.AdaptiveSmoothing(eta),
            equation_of_state=ps.IdealGas(GAMMA),
            smoothing="cubic_spline",
            viscosity=ps.ArtificialViscosity(1.0, 2.0),
        )
    )
    return scene


def radius(time: float) -> float:
    """Of the shock."""
    return XI * time**0.4


def front(sim: ps.Simulation) -> float:
    """The shock's radius by how far the gas has come: sum of m (r - r at the start) = MOMENT R^4.

    A sum over all of the gas: how many lengths the shock is smeared over hardly matters.
    """
    (scene,) = sim.scenes
    way = np.linalg.norm(sim.position, axis=1) - np.linalg.norm(scene.position, axis=1)
    return float(((scene.mass * way).sum() / MOMENT) ** 0.25)


def error(sim: ps.Simulation) -> float:
    """By which part the shock's radius is off."""
    return abs(front(sim) / radius(sim.time) - 1.0)
