"""Limits of contacts, boundaries and constraints."""

import math

import pytest

import particlesim as ps
from cases.stability import grains, limit, simulation


def test_contact_by_speed_and_acceleration():
    assert limit(grains([(2, 0, 0), (-2, 0, 0)])) == pytest.approx(0.02 / 2)
    assert limit(grains([(2, 0, 0), (2, 0, 0)])) == math.inf  # they never meet
    scene = grains((0, 0, 0))
    scene.add_interaction(ps.UniformGravity((0, -10, 0)))
    assert limit(scene) == pytest.approx(math.sqrt(0.02 / 10))


def test_contact_stops_what_is_within_the_limit():
    # Past it they are found on their way, too, if they are near as a substep ends.
    for factor, meet in ((0.95, True), (4.0, True)):
        # A step starts a little before they touch.
        scene = grains([(10, 0, 0), (-10, 0, 0)], distance=2 * 0.02 + 1e-4)
        sim = simulation(scene, dt=factor * 0.002, watchdog=False)
        assert sim.stability().dt == pytest.approx(0.002)
        sim.step()
        sim.step()
        assert (sim.position[0, 0] < sim.position[1, 0]) == meet


def test_box_by_speed():
    scene = ps.Scene()
    scene.add_particles([(0.5, 0.5, 0.5)], velocity=(1, -40, 2))
    scene.add_constraint(ps.BoxBoundary((0, 0, 0), (1, 2, math.inf)))
    report = simulation(scene).stability()
    assert report.dt == pytest.approx(2 / 40) and "along y" in report.binding.reason


def test_xpbd_is_not_limited_but_damps():
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1, 0, 0)], mass=2.0)
    scene.add_constraint(ps.Distance([(0, 1)], compliance=0.01))
    report = simulation(scene, dt=0.1).stability()
    (only,) = report.limits
    assert report.dt == only.dt == math.inf
    # omega = sqrt((1/2 + 1/2) / 0.01) = 10; E falls to 1/e in dt / ln(1 + 1) = 0.144 s.
    assert "omega = 10 /s" in only.reason and "0.144 s" in only.reason
