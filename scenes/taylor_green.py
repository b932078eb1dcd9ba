"""Taylor and Green's vortices (1937) in a plane: a liquid that viscosity brings to rest.

Periodic, in units of the square's side and the fastest speed at the start, at which the Reynolds
number is 1 / viscosity. The flow keeps its form, and its energy falls as exp(-16 pi^2 nu t). The
vortices pull particles into strings along the lines between them; shifting keeps them apart.
"""

import numpy as np

import particlesim as ps

frames = 20
settings = ps.Settings(dt=0.05, substeps=50)

SOUND = 10.0  # speed of sound


def build(count: int = 50, viscosity: float = 0.01, shifting: float = 1.0) -> ps.Scene:
    """Four vortices.

    Args:
        count: Particles along a side.
        viscosity: Kinematic.
        shifting: Speed of the particles' shifting, in that of the fastest flow.
    """
    spacing = 1.0 / count
    x = ps.sample.box((0, 0, 0), (1, 1, 0), spacing)
    a, b = 2 * np.pi * x[:, 0], 2 * np.pi * x[:, 1]
    flow = np.stack([-np.cos(a) * np.sin(b), np.sin(a) * np.cos(b), 0 * a], axis=1)
    scene = ps.Scene(periodic=((0, 0, None), (1, 1, None)), up_axis="z")
    scene.add_particles(
        x, velocity=flow, mass=spacing**2, radius=0.4 * spacing, group="liquid"
    )  # fmt: skip
    scene.add_interaction(
        ps.SPH(
            smoothing_length=2 * spacing,
            rest_density=1.0,
            equation_of_state=ps.Tait(SOUND, negative_pressure=True),
            viscosity=[ps.LaminarViscosity(viscosity), ps.ParticleShifting(shifting)],
            dimension=2,
        )
    )
    return scene


def error(sim: ps.Simulation) -> float:
    """By which part the kinetic energy is off."""
    (scene,) = sim.scenes
    (fluid,) = scene.interactions
    rate = 16 * np.pi**2 * fluid.viscosity[0].parameters["kinematic_viscosity"]
    return abs(float(sim.diagnostics().kinetic[0]) / (0.25 * np.exp(-rate * sim.time)) - 1.0)
