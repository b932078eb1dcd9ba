"""Unions, intersections and complements: set algebra, and what is their parts' own."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps

G = 9.81
BALL = ps.SphereBoundary((0, 0, 0), 0.6, inside=False, friction=0.9)
FLOOR = ps.PlaneBoundary((0, -0.3, 0), (0, 1, 0), friction=0.1)


@ps.law
def torus(x: wp.vec3, ring: float, tube: float):
    return wp.length(wp.vec2(wp.length(wp.vec2(x[0], x[2])) - ring, x[1])) - tube


@pytest.mark.slow
def test_distances_are_least_and_largest():
    x = np.random.default_rng(0).uniform(-1, 1, (1000, 3))
    ball, floor = BALL.distance(x), FLOOR.distance(x)
    assert np.array_equal((BALL | FLOOR).distance(x), np.minimum(ball, floor))
    assert np.array_equal((BALL & FLOOR).distance(x), np.maximum(ball, floor))
    assert np.array_equal((BALL - FLOOR).distance(x), np.maximum(ball, -floor))
    assert np.array_equal((~BALL).distance(x), -ball)


@pytest.mark.slow
def test_a_block_has_round_corners():
    """The complement of a box, to the nearest point of it."""
    x = np.random.default_rng(0).uniform(-1, 1, (1000, 3))
    q = np.abs(x) - 0.5
    exact = np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0)
    block = ~ps.BoxBoundary((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5))
    assert np.allclose(block.distance(x), exact, atol=1e-15)


@pytest.mark.slow
def test_what_is_held_is_off_by_the_radius(precision, device, simulate, scene_of):
    """Of nested combinations of solids with laws: everything is out after some sweeps."""
    rng = np.random.default_rng(1)
    x, radius = rng.uniform(-1, 1, (500, 3)), rng.uniform(0, 0.08, 500)
    ring = ps.Boundary(torus, ring=0.6, tube=0.2)
    for solid in (BALL | FLOOR, (BALL | ring) & FLOOR, ~BALL, BALL - ring):
        sim = simulate(scene_of(x, solid, radius=radius), device, precision=precision)
        sim.project(60)
        # In a notch one way leads into the other, by half as much or less each time.
        assert (solid.distance(sim.position) - radius).min() > -1e-5


@pytest.mark.slow
def test_each_part_has_its_own_friction(device, simulate, scene_of):
    """On a table of two materials one grain slides and stops, and another goes on as on ice."""
    rough = ~ps.BoxBoundary((-50, -1, -50), (0, 0, 50), friction=0.5)
    table = rough | ~ps.BoxBoundary((0, -1, -50), (50, 0, 50))
    x = [(-10, 0.1, 0), (10, 0.1, 0)]
    scene = scene_of(x, table, velocity=(0, 0, 2), radius=0.1, gravity=True)
    sim = simulate(scene, device)
    sim.run(60)
    # Stops after v^2 / (2 mu g); symplectic Euler by mu g h / v sooner.
    assert sim.position[0, 2] == pytest.approx(4 / (2 * 0.5 * G), rel=0.5 * G * 0.01 / 2 * 1.01)
    assert sim.position[1, 2] == pytest.approx(2 * sim.time, rel=1e-12)


@pytest.mark.slow
def test_a_moving_combination_takes_along(device, simulate, scene_of):
    """A cup: a cylinder with a bore, lifted at a constant speed."""
    outer = ps.CylinderBoundary((0, 0, 0), (0, 1, 0), 0.5)
    bore = ps.CylinderBoundary((0, 0.2, 0), (0, 2, 0), 0.4)
    solid = outer - bore
    cup = ps.UnionBoundary(solid, solid, velocity=(0, 2.0, 0))
    sim = simulate(scene_of([(0, 0.3, 0)], cup, radius=0.1, gravity=True), device, substeps=4)
    sim.run(50)
    assert sim.position[0] == pytest.approx([0, 0.3 + 2 * sim.time, 0], abs=1e-9)
    shapes = cup.shapes()
    assert shapes
    assert all(shape["moving"] for shape in shapes)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: ps.UnionBoundary(BALL, 3), "second must be a boundary"),
        (lambda: ~ps.SphereBoundary((0, 0, 0), 1.0, velocity=(1, 0, 0)), "part must be at rest"),
        (lambda: BALL | ps.SphereBoundary((0, 0, 0), 1.0, group="g"), "second must be at rest"),
    ],
)
def test_refusals(make, told):
    with pytest.raises(ValueError, match=told):
        make()
