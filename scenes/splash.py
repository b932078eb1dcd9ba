"""A drop falls into a pool (Macklin and Mueller 2013): position-based water, which comes to rest.

Then the level has risen by what the drop holds. The error is that of the height of the middle of
the water, in parts of it.
"""

import particlesim as ps

GRAVITY, DENSITY = 9.81, 1000.0

frames = 240
settings = ps.Settings(dt=1 / 60, substeps=4, iterations=4)


def build(
    width: float = 0.6, depth: float = 0.3, drop: float = 0.2, height: float = 0.8,
    spacing: float = 0.03,
) -> ps.Scene:  # fmt: skip
    """A pool and the drop above it.

    Args:
        width: Of the square pool [m].
        depth: Of its water [m].
        drop: Radius of the drop [m].
        height: Of the middle of the drop above the floor [m].
        spacing: Of the particles [m].
    """
    scene = ps.Scene()
    mass, radius = DENSITY * spacing**3, spacing / 2
    pool = ps.sample.box((0, 0, 0), (width, depth, width), spacing)
    ball = ps.sample.sphere((width / 2, height, width / 2), drop, spacing)
    bodies = {"pool": pool, "drop": ball}
    water = [scene.add_particles(x, mass=mass, radius=radius, group=k) for k, x in bodies.items()]
    scene.add_interaction(ps.UniformGravity((0, -GRAVITY, 0)))
    scene.add_constraint(
        ps.FluidDensity(water, rest_density=DENSITY, smoothing_length=1.6 * spacing)
    )
    scene.add_constraint(ps.BoxBoundary((0, 0, 0), (width, 2 * (height + drop), width)))
    return scene


def error(sim: ps.Simulation) -> float:
    """By how much the middle of the water is off its height at rest, at the present time."""
    (scene,) = sim.scenes
    walls = scene.constraints[1]
    floor = (walls.upper[0] - walls.lower[0]) * (walls.upper[2] - walls.lower[2])
    level = float(scene.mass.sum()) / DENSITY / floor
    return abs(2.0 * float(sim.position[:, 1].mean()) / level - 1.0)
