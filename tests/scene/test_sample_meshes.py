"""Samplers of curves, meshes and solids: counts, areas, volumes, and what is refused."""

import numpy as np
import pytest

from particlesim import sample


def area(vertices, triangles):
    a, b, c = np.asarray(vertices)[triangles.T]
    return 0.5 * np.cross(b - a, c - a)


def volume(vertices, tetrahedra):
    a, b, c, d = vertices[tetrahedra.T]
    return (np.cross(b - a, c - a) * (d - a)).sum(axis=1) / 6


def enclosed(vertices, triangles):
    """By the divergence theorem."""
    a, b, c = vertices[triangles.T]
    return (np.cross(a, b) * c).sum() / 6


# Curves


def test_a_curve_has_even_arcs_and_both_ends():
    corners = np.array([(0, 0, 0), (3, 0, 0), (3, 4, 0), (3, 4, 5.05)])
    points = sample.curve(corners, spacing=0.5)
    assert len(points) == 1 + 24  # 12.05 in parts of about 0.5
    np.testing.assert_allclose(points[[0, -1]], corners[[0, -1]], atol=1e-15)
    step = np.linalg.norm(np.diff(points, axis=0), axis=1)
    # Equal but where it turns by a right angle: there between part / sqrt(2) and a part.
    part = 12.05 / 24
    assert np.isclose(step, part, atol=1e-12).sum() >= 22
    assert step.min() > part / np.sqrt(2) - 1e-12
    assert len(sample.curve(corners, spacing=100.0)) == 2


@pytest.mark.parametrize(
    ("points", "match"),
    [
        ([(0, 0, 0)], "points must be at least two, got 1"),
        ([(0, 0, 0), (1, 0, 0), (1, 0, 0)], r"points\[2\] must differ from the one before"),
        ([(0, 0, 0), (np.nan, 0, 0)], r"points\[1, 0\] must be finite"),
    ],
)
def test_curves_that_are_none_are_refused(refused, points, match):
    with refused(match):
        sample.curve(points, spacing=1.0)


# Surfaces


def test_a_rectangle_covers_its_area_and_faces_where_it_says():
    vertices, triangles = sample.rectangle((1, 2, 3), [(0, 0, 2), (3, 0, 0)], cells=(4, 5))
    assert len(vertices) == 5 * 6 and len(triangles) == 2 * 4 * 5
    # Cells of 0.5 and 0.6, of two halves each.
    np.testing.assert_allclose(
        area(vertices, triangles), np.tile((0, 0.15, 0), (40, 1)), atol=1e-12
    )
    assert (vertices.min(axis=0) == (1, 2, 3)).all() and (vertices.max(axis=0) == (4, 2, 5)).all()
    # Along both sides, and a diagonal a cell.
    assert len(sample.edges(triangles)) == 5 * 5 + 4 * 6 + 20
    # Diagonals cross: inner vertices have four or eight edges, and none six.
    inner = np.bincount(sample.edges(triangles).ravel()).reshape(5, 6)[1:-1, 1:-1]
    assert set(inner.ravel()) == {4, 8}


@pytest.mark.parametrize("subdivisions", [0, 1, 3])
def test_an_icosphere_is_closed_round_and_even(subdivisions):
    center = np.array([1.0, -2.0, 3.0])
    vertices, triangles = sample.icosphere(center, 2.0, subdivisions)
    assert len(vertices) == 10 * 4**subdivisions + 2 and len(triangles) == 20 * 4**subdivisions
    np.testing.assert_allclose(np.linalg.norm(vertices - center, axis=1), 2.0, atol=1e-12)
    assert len(sample.edges(triangles)) == 30 * 4**subdivisions  # Euler's V - E + F = 2
    if subdivisions == 0:  # the icosahedron's volume for its circumradius R: 2.5361507 R^3
        assert enclosed(vertices, triangles) == pytest.approx(2.5361507 * 8, rel=1e-7)
    else:  # chords of edge e lie e^2 / 8 R deeper: less than 3 e^2 / 8 R^2 of the volume is missing
        edge = np.ptp(vertices[sample.edges(triangles)], axis=1)
        depth = (edge**2).sum(axis=1).max() / 32
        assert 1 - 3 * depth < enclosed(vertices, triangles) / (4 / 3 * np.pi * 8) < 1


def test_points_are_inside_where_the_surface_winds_about_them():
    rng = np.random.default_rng(3)
    vertices, triangles = sample.icosphere((0, 0, 0), 1.0, 3)
    points = rng.uniform(-1.2, 1.2, (500, 3))
    r = np.linalg.norm(points, axis=1)
    clear = np.abs(r - 1) > 0.02  # chords of edge 0.16 lie 0.003 deeper
    assert (sample.inside(points, vertices, triangles) == (r < 1))[clear].all()
    # A shell: a second surface that faces inwards.
    shell = np.concatenate([vertices, 0.5 * vertices])
    both = np.concatenate([triangles, triangles[:, ::-1] + len(vertices)])
    found = sample.inside([(0, 0, 0), (0.75, 0, 0), (2, 0, 0)], shell, both)
    assert found.tolist() == [False, True, False]


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (lambda f: f[1:], "triangles must enclose a volume, .* got 'edge "),
        (lambda f: f[:, ::-1], "triangles must be counterclockwise as seen from outside"),
        (lambda f: np.concatenate([f, f[:1]]), "triangles must turn the same way round"),
        (lambda f: np.concatenate([f[:1, ::-1], f[1:]]), "triangles must turn the same way round"),
        (lambda f: f + 1, "triangles must hold indices from 0 to 11, got 12"),
        (lambda f: f[:0], "triangles must be whole numbers"),
    ],
)
def test_surfaces_with_holes_are_refused(refused, change, match):
    vertices, triangles = sample.icosphere((0, 0, 0), 1.0, 0)
    for fill in (sample.mesh_points, sample.mesh_tetrahedra):
        with refused(match):
            fill(vertices, change(triangles), spacing=0.5)


# Solids


def test_a_box_of_tetrahedra_is_whole():
    lower, upper = np.array((1.0, 2, 3)), np.array((3.0, 3, 4.5))
    vertices, tetrahedra = sample.box_tetrahedra(lower, upper, spacing=0.5)
    assert len(vertices) == 5 * 3 * 4 and len(tetrahedra) == 5 * 4 * 2 * 3
    sizes = volume(vertices, tetrahedra)
    # Four of a sixth of a cell, one of a third.
    assert np.isclose(sizes, 0.125 / 6).sum() == 4 * 24 and np.isclose(sizes, 0.125 / 3).sum() == 24
    # Its faces are those of the box: diagonals of neighbours meet.
    faces = sample.surface(tetrahedra)
    assert len(faces) == 2 * 2 * (4 * 2 + 4 * 3 + 2 * 3)
    assert enclosed(vertices, faces) == pytest.approx(3.0)
    on_side = (vertices[faces] == lower) | (vertices[faces] == upper)
    assert on_side.all(axis=1).any(axis=1).all()


def test_what_fills_a_mesh_has_its_volume():
    side = 0.125
    mesh = sample.icosphere((5, 0, 0), 1.0, 2)
    points = sample.mesh_points(*mesh, spacing=side)
    # Each of the 4 pi / s^2 cells at the surface is wrong by some 0.3 of a cell at random, eight
    # alike, as grid and sphere are mirrored in three planes: 0.3 sqrt(8 4 pi / s^2) s^3 = 0.047.
    assert len(points) * side**3 == pytest.approx(enclosed(*mesh), abs=4 * 0.047)
    # Those that are asked about are those that would be one by one.
    grid = sample.box(points.min(axis=0) - 1.5 * side, points.max(axis=0) + 1.5 * side, side)
    found = grid[sample.inside(grid, *mesh)]
    np.testing.assert_allclose(found, points, atol=1e-12)


def test_tetrahedra_that_fill_a_mesh_end_at_its_surface():
    side, radius = 0.25, 1.0
    mesh = sample.icosphere((5, 0, 0), radius, 2)
    vertices, tetrahedra = sample.mesh_tetrahedra(*mesh, spacing=side)
    faces = sample.surface(tetrahedra)
    assert len(np.unique(tetrahedra)) == len(vertices)
    far = np.linalg.norm(vertices - (5, 0, 0), axis=1)
    # A cell of the lattice has twelve; none has lost nine tenths, inner ones nothing.
    sizes = volume(vertices, tetrahedra) / (side**3 / 12)
    assert sizes.min() >= 0.1 * (1 - 1e-9)
    # An outer vertex has moved by half an edge of the lattice, side, at most.
    inner = (far[tetrahedra] < radius - 0.5 * side - 0.02).all(axis=1)
    assert inner.sum() > 500
    np.testing.assert_allclose(sizes[inner], 1.0)
    # Outer vertices are on the mesh, between the middles of its triangles and the sphere, but for
    # one in ten that lie bare, half a side deep at most, where one is left out for being too thin.
    edge = np.ptp(mesh[0][sample.edges(mesh[1])], axis=1)
    depth = radius - np.sqrt(radius**2 - (edge**2).sum(axis=1).max() / 3)  # of a triangle's middle
    outer = far[np.unique(faces)]
    assert (outer > radius - depth).mean() > 0.9
    assert outer.min() > radius - 0.5 * side and outer.max() < radius + 1e-12
    # It is closed, and less than the mesh by its own chords: a^2 / 6 deep over triangles of side a.
    sample.inside([(0, 0, 0)], vertices, faces)
    whole = volume(vertices, tetrahedra).sum()
    assert enclosed(vertices, faces) == pytest.approx(whole)
    assert 1 - 3 * side**2 / 6 < whole / enclosed(*mesh) < 1


def test_solids_that_are_none_are_refused(refused):
    with refused("upper must be above lower on every axis"):
        sample.box_tetrahedra((0, 0, 0), (1, 0, 1), spacing=0.5)
    with refused("spacing must be below the size of the mesh"):
        # Two flat pyramids on a bent base: the middle of the only cell is outside.
        a = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype=float)
        sample.mesh_points(a, [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)], spacing=1.0)
    with refused(r"tetrahedra must be whole numbers of shape \(t, 4\)"):
        sample.surface([(0, 1, 2)])


# Files

CUBE = """\
# a unit cube of quadrilaterals, and a vertex that none has
v 0 0 0
v 9 9 9
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1
v 1 0 1
v 1 1 1
v 0 1 1
f 5 4 3 1
f 6 7 8 9
f 1 3 7 6
f 4 5 9 8
f 3 4 8 7
f 5 1 6 9
"""


def test_a_file_gives_a_closed_mesh(tmp_path, refused):
    pytest.importorskip("meshio")
    path = tmp_path / "cube.obj"
    path.write_text(CUBE)
    mesh = sample.mesh(path)
    assert mesh.vertices.shape == (8, 3) and mesh.triangles.shape == (12, 3)
    assert mesh.tetrahedra.shape == (0, 4)
    assert enclosed(mesh.vertices, mesh.triangles) == pytest.approx(1.0)
    assert len(sample.mesh_points(mesh.vertices, mesh.triangles, 0.25)) == 64
    (tmp_path / "cube.ply").write_text("nonsense")
    with refused("path must be a mesh that meshio can read"):
        sample.mesh(tmp_path / "cube.ply")


def test_a_file_without_a_reader_says_what_to_install(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "meshio", None)
    with pytest.raises(ImportError, match=r"pip install 'particlesim\[mesh\]'"):
        sample.mesh("cube.obj")
