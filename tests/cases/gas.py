"""A cloud of gas with smoothing lengths of its own."""

import numpy as np

import particlesim as ps

ETA, GAMMA = 1.2, 5 / 3
VISCOSITY = ps.ArtificialViscosity(1.0, 2.0)
SIGMA = 21 / (16 * np.pi)
BOX = ((-2.0, -2.0, -2.0), (2.0, 2.0, 2.0))


def cloud(count, seed=1, periodic=None, viscosity=VISCOSITY, state=None, group=None, **options):
    """Gas that is some hundred times as dense in the middle as outside, and quick."""
    random = np.random.default_rng(seed)
    x = random.normal(0, 0.7, (count, 3))
    if periodic is not None:
        x = random.uniform(-2, 2, (count, 3)) * np.where(np.arange(count) % 2, 1, 0.3)[:, None]
    scene = ps.Scene(periodic=periodic)
    scene.add_particles(
        x, mass=random.uniform(0.5, 1.5, count) / count, velocity=random.normal(0, 0.5, (count, 3)),
        internal_energy=random.uniform(0.5, 1.5, count),
    )  # fmt: skip
    scene.add_interaction(
        ps.SPH(group, smoothing_length=ps.AdaptiveSmoothing(ETA, **options),
               equation_of_state=state or ps.IdealGas(GAMMA), viscosity=viscosity)
    )  # fmt: skip
    return scene


def simulate(scene, device="cpu", integrator="velocity_verlet", **knobs):
    settings = ps.Settings(
        **{"dt": 0.02, "substeps": 4, "precision": "float64", "integrator": integrator, **knobs}
    )
    return ps.Simulation(scene, settings, device=device)
