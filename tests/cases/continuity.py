"""Fluids whose density goes by continuity."""

import numpy as np

import particlesim as ps

H, SOUND = 0.7, 10.0


def stirred(density, held=False, count=8):
    """A square of fluid that is stirred, periodic or held by two walls."""
    spacing = 1 / count
    x = ps.sample.box((0, 0, 0), (1, 1, 0), spacing)
    noise = np.random.default_rng(0).normal(0, 0.1, x.shape) * [1, 1, 0]
    turns = np.stack([np.sin(2 * np.pi * x[:, 1]), np.sin(2 * np.pi * x[:, 0]), 0 * x[:, 0]], 1)
    scene = ps.Scene(periodic=None if held else ((0, 0, None), (1, 1, None)))
    scene.add_particles(x, velocity=0.3 * turns + noise, mass=spacing**2, radius=spacing / 2)
    scene.add_interaction(
        ps.SPH(smoothing_length=2 * spacing, rest_density=1.0, dimension=2, density=density,
               equation_of_state=ps.Tait(SOUND, negative_pressure=True))
    )  # fmt: skip
    if held:
        for normal in ((1, 0, 0), (0, 1, 0)):
            scene.add_constraint(ps.PlaneBoundary((0, 0, 0), normal))
    return scene


def simulate(scene, substeps, dt=0.02, device="cpu", **knobs):
    settings = ps.Settings(dt=dt, substeps=substeps, **{"precision": "float64", **knobs})
    return ps.Simulation(scene, settings, device=device)


def loose(x, v=0.0, m=1.0, rho=1.0, diffusion=0.2, sound=SOUND, h=H, **options):
    """Fluid in the open, in three dimensions."""
    scene = ps.Scene()
    scene.add_particles(x, velocity=v, mass=m, start_density=rho)
    scene.add_interaction(
        ps.SPH(smoothing_length=h, rest_density=1.0, equation_of_state=ps.Tait(sound),
               density=ps.ContinuityDensity(diffusion), **options)
    )  # fmt: skip
    return scene
