"""Heaps of grains stand, at every order of what holds them; overlaps of a start do not explode."""

import numpy as np
import pytest

import particlesim as ps

RADIUS, FRICTION = 0.05, 0.5


def heap(order=1, layers=5):
    """A pyramid of 25, 16, 9, 4 and 1 grains, whose lowest layer friction holds together."""
    x = []
    for k in range(layers):
        along = RADIUS * (2 * np.arange(layers - k) - (layers - k - 1))
        x += [(a, RADIUS * (1 + np.sqrt(2) * k), b) for a in along for b in along]
    scene = ps.Scene()
    scene.add_particles(x, radius=RADIUS)
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    floor = ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=FRICTION)
    for each in (ps.Contact(friction=FRICTION), floor)[::order]:
        scene.add_constraint(each)
    return scene


@pytest.mark.slow
@pytest.mark.parametrize("knobs", [{}, {"substeps": 20, "iterations": 4}])
def test_a_heap_of_55_grains_stands_for_a_minute(knobs, device):
    ends = []
    for order in (1, -1):
        sim = ps.Simulation(heap(order), ps.Settings(**knobs), device=device)
        start = sim.position
        sim.run(60)
        rested = sim.position
        # It sinks by its overlaps: 2 split k g h^2 below k layers, h = 1/600, split up to 4.
        assert np.abs(rested - start).max() < 2 * 4 * (1 + 2 + 3 + 4 + 5) * 9.81 / 600**2
        sim.run(600)
        assert np.abs(sim.position - rested).max() < 1e-5 * RADIUS
        sim.run(2940)
        assert np.abs(sim.position - rested).max() < 6e-5 * RADIUS
        ends.append(sim.position)
    assert np.array_equal(*ends)


@pytest.mark.slow
@pytest.mark.parametrize(("radius", "speed"), [(0.05, None), (0.5, 0.01)])
def test_an_overlapping_start_gains_less_than_a_joule(radius, speed, device):
    """216 unit masses at rest that overlap by 5 %, as issue 1456 of Newton has them.

    Growing takes 30 frames, half a second: speeds go with the radius, 0.5 m/s at one of 0.5 m,
    unless ``depenetration_speed`` says less.
    """
    scene = ps.Scene()
    x = ps.sample.lattice("sc", (6, 6, 6), 0.95 * 2 * radius)
    scene.add_particles(x, radius=radius)
    scene.add_constraint(ps.Contact())
    settings = ps.Settings(dt=1 / 60, substeps=10, depenetration_speed=speed)
    sim = ps.Simulation(scene, settings, device=device)
    kinetic = []
    for _ in range(360):
        sim.step()
        kinetic.append(float(sim.diagnostics().kinetic[0]))
    assert max(kinetic) < 1.0
