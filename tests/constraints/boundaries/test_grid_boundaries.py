"""Sampled distances and heights: order in the spacing, exact triangles, nothing falls through."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps

G = 9.81


@ps.law
def ball(x: wp.vec3, radius: float):
    return wp.length(x) - radius


def sampled_ball(nodes):
    """A ball of radius 1/2 in a box of side 2."""
    x = np.stack(np.meshgrid(*3 * [np.linspace(-1, 1, nodes)], indexing="ij"))
    return ps.SDFBoundary(np.linalg.norm(x, axis=0) - 0.5, (-1, -1, -1), 2 / (nodes - 1))


def test_a_sampled_ball_is_off_by_the_second_order():
    """At most h^2 / 8 times the sum of second derivatives, 2 / r, twice over: 0.5 h^2 / 0.5."""
    x = np.random.default_rng(0).normal(0, 1, (2000, 3))
    x *= 0.5 / np.linalg.norm(x, axis=1, keepdims=True)
    errors = [np.abs(sampled_ball(n).distance(x)).max() for n in (11, 21, 41)]
    assert errors[0] < 0.2**2
    assert np.allclose(np.log2(np.divide(errors[:-1], errors[1:])), 2, atol=0.15)


@pytest.mark.slow
def test_laws_and_volumes_are_sampled_alike():
    grid = sampled_ball(41)
    law = ps.SDFBoundary(ball, (-1, -1, -1), 0.05, upper=(1, 1, 1), radius=0.5)
    assert np.allclose(law.values, grid.values, atol=1e-15)
    values = grid.values.astype(np.float32)
    given = {"min_world": (-1, -1, -1), "voxel_size": 0.05, "device": "cpu"}
    volume = ps.SDFBoundary(wp.Volume.load_from_numpy(values, **given))
    assert np.allclose(volume.values[:41, :41, :41], values)
    assert np.allclose(volume.lower, -1)
    assert volume.spacing == pytest.approx(0.05)


@pytest.mark.slow
def test_beyond_the_grid():
    """Away from a ball that ends in it; deeper into what a container leaves of it."""
    x = np.array([(3.0, 0, 0), (0, -1.5, 0), (2, 2, 2)])
    beyond = np.linalg.norm(np.maximum(np.abs(x) - 1, 0), axis=1)
    edge = np.linalg.norm(np.clip(x, -1, 1), axis=1) - 0.5
    grid = sampled_ball(21)
    assert np.allclose(grid.distance(x), edge + beyond)
    container = ps.SDFBoundary(-grid.values, (-1, -1, -1), grid.spacing)
    assert np.allclose(container.distance(x), -(edge + beyond))


@pytest.mark.slow
def test_heights_are_triangles(precision, device, simulate, scene_of):
    """As a sheet of the same triangles, on any axis; what is below is led out."""
    rng = np.random.default_rng(1)
    heights = rng.uniform(-0.2, 0.2, (20, 21))
    for up in "xyz":
        x = rng.uniform(0.6, 1.3, (500, 3))
        field = ps.HeightfieldBoundary(heights, (0, 0, 0), 0.1, up=up)
        shape = field.shapes()[0]
        corners = shape["points"][shape["triangles"]]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert (normals[:, field.up] > 0).all()
        sheet = ps.MeshBoundary(shape["points"], shape["triangles"], sheet=True)
        x[:, field.up] = rng.uniform(-0.5, 0.5, len(x))
        assert np.allclose(np.abs(field.distance(x)), sheet.distance(x), atol=1e-15)
    sim = simulate(scene_of(x, field, radius=0.02), device, precision=precision)
    sim.project(30)
    # From one face into another, in smaller and smaller ways.
    assert field.distance(sim.position).min() > 0.02 - 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("speed", [1.0, 100.0, 1e5])
def test_nothing_falls_through_the_ground(speed, precision, device, simulate, scene_of):
    rng = np.random.default_rng(2)
    x = rng.uniform(0.2, 1.8, (200, 3)) * [1, 0, 1] + [0, 0.5, 0]
    heights = 0.1 * np.sin(np.arange(41)[:, None] * 0.3) * np.cos(np.arange(41) * 0.4)
    ground = ps.HeightfieldBoundary(heights, (0, 0, 0), 0.05, friction=0.3)
    scene = scene_of(x, ground, velocity=(0, -speed, 0), radius=0.02, gravity=True)
    sim = simulate(scene, device, precision=precision)
    sim.run(30)
    depth = ground.distance(sim.position)
    assert depth.min() > 0  # the middle of none is in the ground


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["heights", "sampled"])
def test_slopes_hold_below_the_friction_angle(kind, device, simulate, scene_of):
    """A grain lies still at tan = 0.99 mu, and slides at g (sin - mu cos) beyond."""
    mu = 0.5
    for factor in (0.99, 1.2):
        slope = factor * mu
        x = np.linspace(-20, 20, 41)
        if kind == "heights":
            ground = ps.HeightfieldBoundary(
                slope * x[:, None] + 0 * x, (-20, 0, -20), 1.0, friction=mu
            )
        else:
            places = np.meshgrid(x, x, x, indexing="ij")
            d = (places[1] - slope * places[0]) / np.hypot(1, slope)
            ground = ps.SDFBoundary(d, (-20, -20, -20), 1.0, friction=mu)
        angle = np.arctan(slope)
        start = 0.1 * np.array([-np.sin(angle), np.cos(angle), 0]) + [0.3, 0.3 * slope, 0.7]
        sim = simulate(scene_of([start], ground, radius=0.1, gravity=True), device, substeps=10)
        sim.run(100)
        way = np.linalg.norm(sim.position[0] - start)
        a = max(G * (np.sin(angle) - mu * np.cos(angle)), 0.0)
        # Symplectic Euler is h / t ahead.
        assert way == pytest.approx(0.5 * a * sim.time**2, rel=2e-3, abs=1e-9)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: ps.HeightfieldBoundary([(0, 1)], (0, 0, 0), 1.0), "2 axes of 2 nodes"),
        (lambda: ps.HeightfieldBoundary(np.ones((3, 3)), (0, 0, 0), 1.0, up="w"), "one of x, y, z"),
        (lambda: ps.SDFBoundary(np.ones((3, 3)), (0, 0, 0), 1.0), "3 axes of 2 nodes"),
        (lambda: ps.SDFBoundary(np.ones((3, 3, 3)), (0, 0, 0), 1.0, upper=(1, 1, 1)), "left out"),
        (lambda: ps.SDFBoundary(np.ones((3, 3, 3)), (0, 0, 0), 1.0, radius=1.0), "radius"),
        (lambda: ps.SDFBoundary(ball, (0, 0, 0), 1.0, upper=(0, 1, 1), radius=1.0), "above lower"),
    ],
)
def test_refusals(make, told):
    with pytest.raises((ValueError, TypeError), match=told):
        make()
