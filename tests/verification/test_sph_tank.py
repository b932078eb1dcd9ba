"""SPH against known answers: a tank at rest."""

import numpy as np
import pytest

import particlesim as ps


def test_tank_at_rest():
    """p = rho g (H - y), the column keeps its height, and it comes to rest.

    A plane of fluid, periodic sideways, on four layers of pinned particles.
    """
    columns, rows, layers, g = 16, 20, 4, 9.81
    spacing = 1 / rows
    h, c, mass = 1.6 * spacing, 10 * np.sqrt(g), 1000 * spacing**2
    x = ps.sample.box(
        (0, -layers * spacing, 0), (columns * spacing, 1, 0), spacing
    )  # fmt: skip
    scene = ps.Scene(periodic=((0, None, None), (columns * spacing, None, None)))
    scene.add_particles(x[x[:, 1] < 0], mass=mass, pinned=True)
    water = scene.add_particles(x[x[:, 1] > 0], mass=mass)
    scene.add_interaction(ps.UniformGravity((0, -g, 0)))
    scene.add_interaction(
        ps.SPH(smoothing_length=h, rest_density=1000.0, equation_of_state=ps.Tait(c),
               dimension=2, viscosity=ps.ArtificialViscosity(0.1))
    )  # fmt: skip
    scene.add_interaction(ps.Drag(linear=10 * mass, group=water))
    settings = ps.Settings(dt=0.1, substeps=int(np.ceil(0.1 / (0.25 * h / c))))
    sim = ps.Simulation(scene, settings, device="cpu")
    # The rows of the start rest on each other's tips until rounding has grown, which takes some 70
    # frames, and they fall into place.
    sim.run(120)
    y, p = sim.position[water.slice, 1], sim.get("pressure")[water.slice]
    # Water weighs c^2 / (g H) = 100 times less than it resists: a density summed over 25 particles
    # that is 0.05 % off makes a pressure 5 % of the whole off.
    deep = y < 0.9
    weight, offset = np.polyfit(1 - y[deep], p[deep], 1)
    assert weight == pytest.approx(1000 * g, rel=0.05)
    assert np.std(p[deep] - 1000 * g * (1 - y[deep])) < 0.05 * 1000 * g
    assert abs(offset) < 0.05 * 1000 * g
    # Compressed by g H / (2 c^2) = 0.5 % at the floor, half of that on average, and as much again
    # as the last rows, which nothing presses on, have fallen into each other.
    assert abs(2 * y.mean() - 1) < 0.01
    assert np.linalg.norm(sim.velocity, axis=1).max() < 0.01 * np.sqrt(g)
