"""Samplers of shapes: counts, spacings and mass per volume."""

import numpy as np
import pytest

from cases.sample import nearest_distance
from particlesim import sample

# Fillings


def test_box_fills_cell_centres():
    points = sample.box((0, 0, 0), (1, 2, 0.5), spacing=0.25)
    assert points.shape == (4 * 8 * 2, 3) and points.dtype == np.float64
    assert np.allclose(points.min(axis=0), 0.125) and np.allclose(
        points.max(axis=0), (0.875, 1.875, 0.375)
    )
    assert np.allclose(nearest_distance(points), 0.25)


def test_box_mass_is_density_times_volume():
    assert len(sample.box((0, 0, 0), (1, 1, 1), spacing=0.02)) * 0.02**3 == pytest.approx(1.0)


@pytest.mark.parametrize("extent, count", [(0.0, 1), (0.1, 1), (1.0, 4), (1.2, 5), (0.9, 4)])
def test_box_rounds_and_centres(extent, count):
    points = sample.box((0, 0, 0), (extent, 0, 0), spacing=0.25)
    assert len(points) == count
    assert points[:, 0].mean() == pytest.approx(extent / 2)
    assert np.all((points[:, 0] >= 0) & (points[:, 0] <= extent))
    if count > 1:
        assert np.allclose(np.diff(points[:, 0]), 0.25)


def test_box_flat_axis_is_one_layer_and_stays_flat():
    points = sample.box((0, 0, 3), (1, 1, 3), spacing=0.1, jitter=0.5)
    assert len(points) == 100 and np.all(points[:, 2] == 3)


def test_box_jitter_is_bounded_and_repeats():
    grid = sample.box((0, 0, 0), (1, 1, 1), spacing=0.1)
    first = sample.box((0, 0, 0), (1, 1, 1), spacing=0.1, jitter=0.3, seed=4)
    again = sample.box((0, 0, 0), (1, 1, 1), spacing=0.1, jitter=0.3, seed=4)
    other = sample.box((0, 0, 0), (1, 1, 1), spacing=0.1, jitter=0.3, seed=5)
    assert np.array_equal(first, again) and not np.array_equal(first, other)
    # The bound of the draw is 0.03, plus the round-off of a sum of numbers below 1.
    assert 0.025 < np.abs(first - grid).max() <= 0.03 + 1e-15


def test_sphere_counts_lattice_points():
    # Gauss's sphere problem: integer points within radius 5 and 10 of the origin (OEIS A000605).
    assert len(sample.sphere((0, 0, 0), 5.0, 1.0)) == 515
    assert len(sample.sphere((1, -2, 3), 1.0, 0.1)) == 4169


def test_sphere_mass_and_centre():
    center, radius, spacing = np.array([1.0, -2.0, 30.0]), 2.0, 0.1
    points = sample.sphere(center, radius, spacing)
    # Cells of counted points lie within the ball grown by half a cell's diagonal d, and cover the
    # ball shrunk by it: |N s^3 / V - 1| < (1 + d/R)^3 - 1.
    slack = (1 + spacing * np.sqrt(3) / 2 / radius) ** 3 - 1
    assert len(points) * spacing**3 == pytest.approx(4 / 3 * np.pi * radius**3, rel=slack)
    # Symmetric about the centre: the mean is exact up to the round-off of n numbers near 30.
    assert np.allclose(points.mean(axis=0), center, atol=30 * np.finfo(float).eps * len(points))
    assert np.linalg.norm(points - center, axis=1).max() <= radius * (1 + 1e-9)


def test_sphere_smaller_than_spacing_is_one_point():
    assert np.array_equal(sample.sphere((1, 2, 3), 0.1, 1.0), [(1, 2, 3)])


def test_sphere_jitter_stays_inside():
    points = sample.sphere((0, 0, 0), 1.0, 0.2, jitter=0.5)
    assert np.linalg.norm(points, axis=1).max() <= 1 + 1e-9
    assert nearest_distance(points).min() < 0.199


@pytest.mark.parametrize("end", [(0, 0, 2), (0, 1, -2), (3, 4, 12)])
def test_cylinder_any_direction(end):
    start, end = np.array([5.0, 1.0, 0.0]), np.array([5.0, 1.0, 0.0]) + end
    length = np.linalg.norm(end - start)
    radius, spacing = 1.0, length / 10
    points = sample.cylinder(start, end, radius, spacing)
    axis = (end - start) / length
    along = (points - start) @ axis
    across = np.linalg.norm(points - start - along[:, None] * axis, axis=1)
    assert across.max() <= radius * (1 + 1e-9)
    # Round-off of coordinates below 20, on a length of 2 to 13.
    assert along.min() == pytest.approx(spacing / 2, abs=1e-13)
    assert along.max() == pytest.approx(length - spacing / 2, abs=1e-13)
    assert np.allclose(nearest_distance(points), spacing)
    # A layer's count is off by less than the cells that its rim crosses, as in the sphere's test.
    slack = (1 + spacing / np.sqrt(2) / radius) ** 2 - 1
    assert len(points) * spacing**3 == pytest.approx(np.pi * radius**2 * length, rel=slack)


# Lattices


@pytest.mark.parametrize(
    "kind, per_cell, neighbors, distance",
    [
        ("sc", 1, 6, 1.0),
        ("bcc", 2, 8, np.sqrt(3) / 2),
        ("fcc", 4, 12, np.sqrt(1 / 2)),
        ("hcp", 4, 12, 1.0),
    ],
)
def test_lattice_neighbors(kind, per_cell, neighbors, distance):
    constant, cells = 1.7, np.array([3, 4, 5])
    points = sample.lattice(kind, cells, constant, origin=(-1, 0, 2))
    assert len(points) == per_cell * cells.prod()
    assert np.array_equal(points[0], (-1, 0, 2))
    sides = constant * np.array([1, np.sqrt(3), np.sqrt(8 / 3)]) if kind == "hcp" else constant
    period = cells * sides
    gap = points[:, None] - points[None]
    gap -= period * np.round(gap / period)
    r = np.linalg.norm(gap, axis=2)
    np.fill_diagonal(r, np.inf)
    assert r.min() == pytest.approx(distance * constant)
    assert np.all((r < distance * constant * 1.001).sum(axis=1) == neighbors)


def test_lattice_one_number_of_cells():
    assert len(sample.lattice("fcc", 3, 1.0)) == 108
