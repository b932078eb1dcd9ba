"""Drops of water fall into a cloth that hangs by its corners, shake it, and lie in it.

Water by SPH, the cloth by distances; they meet by contacts, in which what one gains the other
loses. The cloth is woven closer than its particles touch the drops, so that none falls through.
"""

import numpy as np

import particlesim as ps

frames = 180
settings = ps.Settings(dt=1 / 60, substeps=40, iterations=8)

GRAVITY, WATER = 9.81, 1000.0  # [m/s^2], [kg/m^3]


def build(
    side: float = 0.6,
    spacing: float = 0.02,
    drops: int = 3,
    radius: float = 0.07,
    height: float = 0.05,
    weight: float = 5.0,
    seed: int = 0,
) -> ps.Scene:
    """A cloth that sags like a sail, and drops above it.

    Args:
        side: Of the cloth [m].
        spacing: Of the water's particles [m]; of the cloth's 0.7 of it.
        drops: How many, one above the other.
        radius: Of a drop [m].
        height: Of the lowest above the corners [m].
        weight: Of the cloth [kg/m^2].
        seed: Of the places of the drops.
    """
    rng = np.random.default_rng(seed)
    scene = ps.Scene()
    edge = round(side / (0.7 * spacing)) + 1
    i, j = np.meshgrid(np.arange(edge), np.arange(edge), indexing="ij")
    a, b = i / (edge - 1) - 0.5, j / (edge - 1) - 0.5
    x = np.stack([a, -0.3 * np.cos(np.pi * a) * np.cos(np.pi * b), b], axis=-1).reshape(-1, 3)
    corners = np.isin(i, (0, edge - 1)) & np.isin(j, (0, edge - 1))
    cloth = scene.add_particles(
        side * x, mass=weight * (side / edge) ** 2, radius=0.34 * spacing,
        pinned=corners.ravel(), group="cloth", color=(0.7, 0.3, 0.2), triangles=triangles(edge),
    )  # fmt: skip
    ball = ps.sample.sphere((0, 0, 0), radius, spacing)
    fall = height + 2.3 * radius * drops
    rain = []
    for k in range(drops):
        aside, up = 0.1 * side * rng.uniform(-1, 1), height + radius * (1 + 2.3 * k)
        rain.append(ball + np.array([aside, up, 0.0]))
    water = scene.add_particles(
        np.concatenate(rain), mass=WATER * spacing**3, radius=0.4 * spacing, group="water",
        color=(0.3, 0.5, 0.8),
    )  # fmt: skip
    scene.add_interaction(ps.UniformGravity((0, -GRAVITY, 0)))
    scene.add_interaction(
        ps.SPH(
            water,
            smoothing_length=1.3 * spacing,
            rest_density=WATER,
            equation_of_state=ps.Tait(10 * (2 * GRAVITY * fall) ** 0.5),
            viscosity=ps.ArtificialViscosity(0.1),
        )
    )
    scene.add_constraint(ps.Distance(threads(edge) + cloth.start))
    scene.add_constraint(ps.Contact(friction=0.2))
    return scene


def threads(edge: int) -> np.ndarray:
    """Pairs of neighbours in a square of particles, along its sides and its diagonals."""
    k = np.arange(edge * edge).reshape(edge, edge)
    ends = (
        (k[:-1], k[1:]),
        (k[:, :-1], k[:, 1:]),
        (k[:-1, :-1], k[1:, 1:]),
        (k[1:, :-1], k[:-1, 1:]),
    )
    return np.concatenate([np.stack([a.ravel(), b.ravel()], axis=1) for a, b in ends])


def triangles(edge: int) -> np.ndarray:
    """Two for each cell of such a square."""
    k = np.arange(edge * edge).reshape(edge, edge)
    a, b, c, d = (each.ravel() for each in (k[:-1, :-1], k[1:, :-1], k[:-1, 1:], k[1:, 1:]))
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([c, b, d], axis=1)])


def error(sim: ps.Simulation) -> float:
    """Which part of the water has come through the cloth, or over its edge."""
    _, water = sim.scenes[0].groups
    return float((sim.position[water.slice, 1] < -0.45).mean())
