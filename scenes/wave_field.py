"""Corks ride the waves of a stretched skin, dent it with their weight, and so draw together.

The skin is a damped wave in two dimensions, u_tt = c^2 lap u - gamma u_t - s / rho, pushed down by
the weight of the corks, which slide down its slopes: each rides on what all excite. Undamped, it
and they keep their energy together, which is the error: what has gone of it, in parts of what the
first wave brought.
"""

import numpy as np

import particlesim as ps

frames = 240
settings = ps.Settings(dt=1 / 60, substeps=32)

GRAVITY = 9.81
DENSITY, SPEED = 1.0, 1.2  # of the skin [kg/m^2], [m/s]


def build(
    count: int = 120,
    length: float = 4.0,
    width: float = 2.0,
    spacing: float = 0.04,
    height: float = 0.06,
    damping: float = 0.0,
    mass: float = 0.002,
    seed: int = 0,
) -> ps.Scene:
    """Corks at rest on a skin with a swell at its left end.

    Args:
        count: Of the corks.
        length: Of the skin along x [m].
        width: Along z [m].
        spacing: Of its nodes [m].
        height: Of the swell [m].
        damping: Of the skin [1/s].
        mass: Of a cork [kg].
        seed: Of their places.
    """
    rng = np.random.default_rng(seed)
    x = np.zeros((count, 3))
    x[:, ::2] = rng.uniform((0.2, 0.2), (length - 0.2, width - 0.2), (count, 2))

    def swell(place: np.ndarray) -> np.ndarray:
        return height * np.exp(-(((place[:, 0] - 0.1 * length) / (0.08 * length)) ** 2))

    skin = ps.GridField(
        (0, None, 0), (length, None, width), spacing, speed=SPEED, density=DENSITY,
        damping=damping, start=swell,
    )  # fmt: skip
    scene = ps.Scene()
    corks = scene.add_particles(x, mass=mass, radius=0.02, group="corks", color=(0.6, 0.4, 0.2))
    scene.add_interaction(ps.FieldForce(skin, corks, coupling="mass", strength=GRAVITY))
    sides = (0, -np.inf, 0), (length, np.inf, width)
    scene.add_constraint(ps.BoxBoundary(*sides, restitution=1.0))
    return scene


def error(sim: ps.Simulation) -> float:
    """Energy that is gone, in parts of that of the swell; the start is simulated anew."""
    start = ps.Simulation(sim.scenes[0], sim.settings, device=sim.device)
    bare = ps.Simulation(build(count=1, mass=1e-9), sim.settings, device=sim.device)
    change = sim.diagnostics().energy[0] - start.diagnostics().energy[0]
    return float(abs(change) / bare.diagnostics().energy[0])
