"""Spheres as containers and as obstacles."""

import numpy as np
import pytest

import particlesim as ps

G = 9.81


def with_ball(x, ball, device, *, gravity=True, radius=0.0, **knobs):
    """Particles that meet a ball, in float64 and one substep a frame unless told otherwise."""
    scene = ps.Scene()
    scene.add_particles(x, radius=radius)
    scene.add_constraint(ball)
    if gravity:
        scene.add_interaction(ps.UniformGravity((0, -G, 0)))
    knobs = {"dt": 1e-4, "substeps": 1, "precision": "float64"} | knobs
    return ps.Simulation(scene, ps.Settings(**knobs), device=device)


@pytest.mark.parametrize("inside", [True, False])
def test_sphere_keeps_in_or_out_by_the_radius(inside, precision, device):
    """Along the line to the center, to |x - c| = r - R or r + R; what is right stays."""
    rng = np.random.default_rng(0)
    x, radius = rng.uniform(-2, 2, (50, 3)), rng.uniform(0, 0.2, 50)
    center, r = np.array([0.1, -0.2, 0.3]), 1.2
    ball = ps.SphereBoundary(center, r, inside, friction=0.5)
    sim = with_ball(x, ball, device, radius=radius, precision=precision)
    sim.project(1)
    d = np.linalg.norm(x - center, axis=1)
    right = np.minimum(d, r - radius) if inside else np.maximum(d, r + radius)
    expected = center + (x - center) * (right / d)[:, None]
    assert np.allclose(sim.position, expected, atol=10 * np.finfo(precision).eps)


def test_sphere_too_narrow_holds_in_the_middle(device):
    """Whatever is as wide as its container or wider; one that is there already stays."""
    ball = ps.SphereBoundary((1, 0, 0), 0.3, restitution=0.5)
    x, radius = [(1.1, 0.1, 0), (1, 0, 0)], [0.4, 0.3]
    sim = with_ball(x, ball, device, radius=radius, dt=1 / 60, substeps=10)
    sim.run(300)
    # It is brought in by e-folds of 30 frames, 10 of them: 0.14 exp(-10).
    assert np.allclose(sim.position, [(1, 0, 0), (1, 0, 0)], atol=1e-5)


def test_the_middle_of_an_obstacle_has_a_way_out(device):
    """A particle there leaves along some direction rather than none."""
    ball = ps.SphereBoundary((0, 0, 0), 0.5, inside=False)
    sim = with_ball([(0, 0, 0)], ball, device, radius=0.1)
    sim.project(1)
    assert np.linalg.norm(sim.position) == pytest.approx(0.6, rel=1e-15)


def test_a_frictionless_bowl_is_a_pendulum(device):
    """A point swings in it like on a rod: through the bottom after a quarter of the period.

    T = 2 pi sqrt(l / g) (1 + a^2 / 16) of amplitude a, with l = r - R.
    """
    r, radius, a = 1.5, 0.1, 0.1
    length = r - radius
    start = length * np.array([np.sin(a), -np.cos(a), 0.0])
    sim = with_ball([start], ps.SphereBoundary((0, 0, 0), r), device, radius=radius)
    quarter = 0.5 * np.pi * np.sqrt(length / G) * (1 + a * a / 16)
    sim.run(round(quarter / 1e-4))
    speed = np.sqrt(2 * G * length * (1 - np.cos(a)))
    assert np.linalg.norm(sim.position) == pytest.approx(length, rel=1e-12)
    # First order: the swing is early or late by some h, and loses a part h / T of its height.
    assert abs(sim.position[0, 0]) < 10 * speed * 1e-4
    assert -sim.velocity[0, 0] == pytest.approx(speed, rel=5e-3)


def test_a_point_leaves_a_smooth_hill_at_two_thirds(device):
    """Sliding down a sphere without friction it takes off at the height 2/3 r above the center."""
    r, a = 1.0, 0.05
    hill = ps.SphereBoundary((0, 0, 0), r, inside=False)
    sim = with_ball([(r * np.sin(a), r * np.cos(a), 0)], hill, device)
    while np.linalg.norm(sim.position[0]) < r * (1 + 1e-7):
        sim.run(20)
    # From rest at the height r cos(a); found within 20 h of a speed of sqrt(2/3 g r) sin.
    left = sim.position[0, 1] / r
    assert left == pytest.approx(2 / 3 * np.cos(a), abs=20e-4 * np.sqrt(2 / 3 * G) + 1e-3)
