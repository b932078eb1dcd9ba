"""Two rubber rings fly at each other, flatten, and bounce off (Gray, Monaghan and Swift 2001).

In the plane, with the rings' density and speed of sound as units: bulk modulus 1, shear modulus
0.22. Rings are links that stay, so that they cannot break, and feel each other only as surfaces
that push: nothing sticks. What the bounce leaves of their flight rings on in them.
"""

import numpy as np
import warp as wp

import particlesim as ps

OUTER, INNER = 4.0, 3.0  # radii
BULK, SHEAR = 1.0, 0.22
YOUNG = 9.0 * BULK * SHEAR / (3.0 * BULK + SHEAR)
POISSON = (3.0 * BULK - 2.0 * SHEAR) / (2.0 * (3.0 * BULK + SHEAR))

frames = 150
settings = ps.Settings(dt=2.0, substeps=40, integrator="velocity_verlet")


@ps.law
def push(r: float, stiffness: float, reach: float):
    """Of the surfaces, nearer than a spacing."""
    overlap = wp.max(reach - r, 0.0)
    return 0.5 * stiffness * overlap * overlap


def build(spacing: float = 0.125, speed: float = 0.059, gap: float = 0.5) -> ps.Scene:
    """The rings side by side along x, on their way.

    Args:
        spacing: Of the particles; a ring is 1 thick.
        speed: Of each ring, in speeds of sound.
        gap: Between the rings.
    """
    scene = ps.Scene()
    around = ps.sample.box((-OUTER, -OUTER, 0), (OUTER, OUTER, spacing), spacing)
    radius = np.hypot(around[:, 0], around[:, 1])
    ring = around[(radius > INNER) & (radius < OUTER)]
    for side, name in ((-1.0, "left"), (1.0, "right")):
        group = scene.add_particles(
            ring + np.array([side * (OUTER + 0.5 * gap), 0.0, 0.0]),
            velocity=(-side * speed, 0, 0), mass=spacing**2, radius=0.5 * spacing, group=name,
        )  # fmt: skip
        scene.add_interaction(
            ps.ElasticSolid(
                group, YOUNG, POISSON, smoothing_length=1.3 * spacing, rest_density=1.0,
                dimension=2,
            )
        )  # fmt: skip
    scene.add_interaction(
        ps.PairPotential(push, groups=scene.groups, cutoff=spacing, stiffness=YOUNG, reach=spacing)
    )
    return scene


def error(sim: ps.Simulation) -> float:
    """How far the energy is from that of the flight, as a part of it: a bounce keeps it."""
    (scene,) = sim.scenes
    start = 0.5 * (scene.mass[:, None] * scene.velocity**2).sum()
    return abs(float(sim.diagnostics().energy[0]) / start - 1.0)
