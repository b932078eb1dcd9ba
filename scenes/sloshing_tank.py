"""Water sloshes in a tank, incompressible and in long steps.

A plane of water, ``length`` long and half as deep, swings in the first mode of its free surface:
omega^2 = g k tanh(k H) with k = pi / L (Lamb 1932, section 228), which moves its centre sideways by
sin(omega t) / omega times its first speed. Its pressures are those of DFSPH, so that the step is
bounded by the flow alone. The error is that of the centre's place, in parts of how far it swings.
"""

import numpy as np

import particlesim as ps

frames = 120
settings = ps.Settings(dt=1 / 60, substeps=4)
GRAVITY = 9.81


def build(length: float = 1.0, spacing: float = 0.025, steepness: float = 0.1) -> ps.Scene:
    """Water at its level, about to swing.

    Args:
        length: L of the tank [m]; the water is half as deep.
        spacing: Of the particles [m].
        steepness: k a, with the height a of the wave.
    """
    depth, k = 0.5 * length, np.pi / length
    x = ps.sample.box((0, 0, 0), (length, depth, 0), spacing)
    speed = steepness / k * frequency(length, depth) / np.sinh(k * depth)
    across, up = k * x[:, 0], k * x[:, 1]
    flow = [-np.sin(across) * np.cosh(up), np.cos(across) * np.sinh(up), np.zeros(len(x))]
    scene = ps.Scene()
    scene.add_particles(
        x,
        velocity=speed * np.stack(flow, axis=1),
        mass=1000.0 * spacing**2,
        radius=0.5 * spacing,
        group="water",
    )
    scene.add_interaction(ps.UniformGravity((0, -GRAVITY, 0)))
    scene.add_interaction(
        ps.DFSPH(smoothing_length=1.6 * spacing, rest_density=1000.0, dimension=2)
    )
    scene.add_constraint(ps.BoxBoundary((0, 0, -np.inf), (length, length, np.inf)))
    return scene


def frequency(length: float, depth: float) -> float:
    """omega of the first mode [1/s]."""
    k = np.pi / length
    return float(np.sqrt(GRAVITY * k * np.tanh(k * depth)))


def error(sim: ps.Simulation) -> float:
    """How far the centre is from where linear waves bring it, in parts of how far it swings."""
    scene = sim.scenes[0]
    x, v = scene.position, scene.column("velocity")
    length, depth = (np.ptp(x, axis=0) + 2 * x.min(axis=0))[:2]
    omega = frequency(length, depth)
    swing = v[:, 0].mean() / omega
    moved = (sim.position[:, 0] - x[:, 0]).mean()
    return float(abs(moved - swing * np.sin(omega * sim.time)) / abs(swing))
