"""A column of sand collapses when its gate is pulled, and runs out as far as has been measured.

In a channel a column of height a times its width L runs out to 1.2 a L, if a < 2.3, else to
1.9 a^(2/3) L (Lube et al. 2005), or to 1.8 a L, if a < 3, else to 2.3 a^(2/3) L (Lajeunesse et al.
2005). The error is that against the mean of both, which are 20 % away from it on either side.
"""

import numpy as np

import particlesim as ps

frames = 150
settings = ps.Settings(dt=1 / 60, substeps=30)

GRAIN, DENSITY = 0.03, 2500.0  # size [m], [kg/m^3]
PACKING = 0.6  # part of the room that grains fill which were poured
OPENS, SPEED = 0.6, 8.0  # time at which the gate goes [s], how fast [m/s]


def build(
    aspect: float = 2.0, across: int = 10, deep: int = 3, friction: float = 0.4, seed: int = 0
) -> ps.Scene:
    """A column in a channel of smooth glass, on a rough floor, which settles behind its gate.

    Args:
        aspect: a, height over width.
        across: Width in grains.
        deep: Depth of the channel in grains.
        friction: Of the grains, on the floor and on the wall behind them.
        seed: Of sizes, a fifth above and below, and of places.
    """
    rng = np.random.default_rng(seed)
    width, depth = across * GRAIN, deep * GRAIN
    # Cubes of a grain each, of which spheres of 0.8 to 1.1 of its size fill 0.453 in the mean.
    filled = np.pi / 6 * (1.1**4 - 0.8**4) / (4 * 0.3)
    layers = max(1, round(aspect * across * PACKING / filled))
    x = ps.sample.lattice("sc", (across, layers, deep), GRAIN, origin=(0.5 * GRAIN,) * 3)
    radius = 0.5 * GRAIN * rng.uniform(0.8, 1.1, len(x))
    scene = ps.Scene()
    scene.add_particles(
        x + rng.uniform(-0.04, 0.04, x.shape) * GRAIN, mass=DENSITY * 4 / 3 * np.pi * radius**3,
        radius=radius, group="sand", color=(0.85, 0.7, 0.45),
    )  # fmt: skip
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    scene.add_constraint(ps.Contact(friction=friction))
    floor = (0, 0, -np.inf), (np.inf, np.inf, np.inf)
    scene.add_constraint(ps.BoxBoundary(*floor, friction=friction))
    scene.add_constraint(ps.BoxBoundary((-np.inf, -np.inf, 0), (np.inf, np.inf, depth)))
    way = 4 * (1 + aspect) * width  # out of reach
    gate = ps.Keyframes([OPENS, OPENS + way / SPEED], places=[(0, 0, 0), (way, 0, 0)])
    scene.add_constraint(ps.PlaneBoundary((width, 0, 0), (-1, 0, 0), motion=gate))
    return scene


def column(sim: ps.Simulation) -> tuple[float, float, float]:
    """Width and depth [m] of the column, and its height over its width, of grains as poured."""
    (scene,) = sim.scenes
    width, depth = float(scene.constraints[-1].point[0]), float(scene.constraints[-2].upper[2])
    height = float(scene.mass.sum()) / (DENSITY * PACKING * width * depth)
    return width, depth, height / width


def runout(sim: ps.Simulation) -> float:
    """By how much it is wider than at first, over that: up to where half of the floor is bare."""
    width, depth, _ = column(sim)
    covered = np.bincount((sim.position[:, 0] / GRAIN).astype(int)) * GRAIN / depth
    bare = np.flatnonzero(np.append(covered, 0.0) < 0.5)[0]
    return float(bare * GRAIN / width - 1.0)


def measured(aspect: float) -> tuple[float, float]:
    """The runouts that Lube and Lajeunesse measured."""
    far = aspect ** (2 / 3)
    return (
        1.2 * aspect if aspect < 2.3 else 1.9 * far,
        1.8 * aspect if aspect < 3.0 else 2.3 * far,
    )


def error(sim: ps.Simulation) -> float:
    """Part by which the runout is off the mean of both."""
    return abs(runout(sim) / float(np.mean(measured(column(sim)[2]))) - 1.0)
