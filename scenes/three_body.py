"""Three equal masses chase each other along a figure of eight.

The periodic solution of Chenciner and Montgomery (2000), G = m = 1, period 6.32591398. The error
is the distance from the start after one period, at a frame near it, measured along the way.
"""

import numpy as np

import particlesim as ps

PERIOD = 6.32591398
ENERGY = -1.28714199177

frames = 200
settings = ps.Settings(
    dt=PERIOD / frames, substeps=40, integrator="velocity_verlet", precision="float64"
)


def build(radius: float = 0.05) -> ps.Scene:
    """Three bodies at the start of the figure eight.

    Args:
        radius: Drawn radius of the bodies.
    """
    scene = ps.Scene(up_axis="z")
    first = np.array([0.97000436, -0.24308753, 0.0])
    third = np.array([-0.93240737, -0.86473146, 0.0])
    scene.add_particles(
        [first, -first, (0, 0, 0)],
        velocity=[-third / 2, -third / 2, third],
        mass=1.0,
        radius=radius,
        group="bodies",
    )
    scene.add_interaction(ps.Gravity(G=1.0))
    return scene


def error(sim: ps.Simulation) -> float:
    """Largest distance of a body from its start, after a whole number of periods."""
    return float(np.abs(sim.position - sim.scenes[0].position).max())
