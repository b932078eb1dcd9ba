"""Where shapes are in a picture, and which is in front."""

import numpy as np
import pytest

import particlesim as ps
from particlesim.output import colors
from particlesim.pictures.render.geometry import Geometry
from particlesim.pictures.render.look import Look

from .shapes import CAMERA, FOCUS, HEIGHT, PLAIN, WHITE, WIDTH, shapes, spheres


def area_tolerance(area):
    """Of 2 x 2 samples a pixel: a disk of R sample widths holds pi R^2 samples, give or take a few
    R^(2/3) (Gauss's circle); 8 bits round what boundary pixels hold by half a level of 255."""
    radius = np.sqrt(area / np.pi)
    return 0.25 * 3.0 * (2.0 * radius) ** (2 / 3) + 2 * np.pi * radius * 0.5 / 255


@pytest.mark.parametrize("center", [(0, 0, 0), (2.5, 0, 0), (-1.5, 1.2, 2.0), (0, -2, -20)])
def test_a_sphere_covers_the_ellipse_of_perspective(cover, center):
    mask = cover(spheres(center, 1.0))
    # The cone of rays around the sphere, of half angle alpha at theta off the axis, cuts the
    # picture in an ellipse with these half axes, whose middle is off that of the sphere.
    to = np.array(center) - CAMERA.position
    distance = np.linalg.norm(to)
    sine, cosine = 1.0 / distance, -to[2] / distance
    under = cosine**2 - sine**2
    area = np.pi * sine * np.sqrt(1 - sine**2) / under * sine / np.sqrt(under) * FOCUS**2
    assert mask.sum() == pytest.approx(area, abs=area_tolerance(area))
    rows, columns = np.indices(mask.shape) + 0.5
    middle = np.array([(columns * mask).sum(), (rows * mask).sum()]) / mask.sum()
    offset = to[:2] / distance * cosine / under * FOCUS * (1, -1)
    # The same samples weigh the middle: off by their share of the area times the radius at most.
    off = area_tolerance(area) / area * np.sqrt(area / np.pi)
    np.testing.assert_allclose(middle, offset + np.array([WIDTH / 2, HEIGHT / 2]), atol=off)


def test_the_nearer_shape_is_seen_in_any_order(draw):
    near, far = ((0, 0, 3), (1.0, 0, 0)), ((1.2, 0, -2), (0, 1.0, 0))
    pictures = []
    for pair in ((near, far), (far, near)):
        position, color = zip(*pair, strict=True)
        pictures.append(draw(spheres(position, 1.0, np.array(color))).array)
    np.testing.assert_array_equal(*pictures)
    assert pictures[0][HEIGHT // 2, WIDTH // 2].tolist() == [255, 0, 0]
    right = int(WIDTH / 2 + 2.1 / 12 * FOCUS)  # the far one's own part
    assert pictures[0][HEIGHT // 2, right].tolist() == [0, 255, 0]


def cube_triangles(size, turn=0.0):
    corners = np.array([[k >> 2 & 1, k >> 1 & 1, k & 1] for k in range(8)]) - 0.5
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    rotation = np.array(
        [[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]]
    )
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return size * corners @ rotation.T, triangles, WHITE


def test_a_cube_covers_its_silhouette(cover):
    straight = cover(shapes(triangles=cube_triangles(2.0))).sum()
    side = 2.0 * FOCUS / 9.0  # the front face, at distance 9
    # Straight edges: each may be off by half a sample along its length.
    assert straight == pytest.approx(side**2, abs=0.25 * 4 * side)
    turned = cover(shapes(triangles=cube_triangles(2.0, np.pi / 4))).sum()
    # Seen on an edge: two trapezoids between the edge in front and those at the sides.
    out = np.sqrt(2.0)
    expected = out / 10 * FOCUS * (2 / 10 + 2 / (10 - out)) * FOCUS
    assert turned == pytest.approx(expected, abs=0.25 * 6 * side)


def test_triangles_leave_no_cracks(cover):
    x = np.linspace(-3, 3, 40)
    points = np.stack([*np.meshgrid(x, x), np.zeros((40, 40))], axis=-1).reshape(-1, 3)
    a = (np.arange(39)[:, None] * 40 + np.arange(39)).ravel()
    quads = np.stack([a, a + 1, a + 41, a, a + 41, a + 40], axis=1).reshape(-1, 3)
    turn = np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]])
    mask = cover(shapes(triangles=(points @ turn.T, quads, WHITE)))
    assert (mask[60:180, 100:220] == 1.0).all()


def test_a_triangle_that_passes_the_camera_is_drawn_to_the_horizon(cover):
    floor = np.array([[-1e4, -1, -1e4], [1e4, -1, -1e4], [1e4, -1, 1e4], [-1e4, -1, 1e4]])
    mask = cover(shapes(triangles=(floor, [(0, 1, 2), (0, 2, 3)], WHITE)))
    # The horizon is in the middle; the end of the floor, 1e4 away, is FOCUS / 1e4 below it.
    assert (mask[: HEIGHT // 2] == 0).all() and (mask[HEIGHT // 2 + 1 :] == 1).all()


def test_a_capsule_reaches_as_far_as_its_tangents(cover):
    mask = cover(shapes(cones=([(-1.5, 0, 0)], [(1.5, 0, 0)], 0.5, WHITE)))
    # Seen from the side a cylinder is r / sqrt(D^2 - r^2) high; an end is between tangents.
    high = 2 * 0.5 / np.sqrt(100 - 0.25) * FOCUS
    assert mask[:, WIDTH // 2].sum() == pytest.approx(high, abs=0.5)
    off = np.arctan2(1.5, 10) + np.arcsin(0.5 / np.hypot(1.5, 10))
    assert mask[HEIGHT // 2].sum() == pytest.approx(2 * np.tan(off) * FOCUS, abs=0.5)


@pytest.mark.parametrize("radii", [(0.8, 0.2), (0.2, 0.9), (0.5, 0.5)])
@pytest.mark.parametrize("end", [(2, 1, 1), (0.3, -0.2, 3), (0.1, 0.1, -4)])
def test_a_cone_is_spheres_along_a_line(draw, end, radii):
    start, end = np.array([-1.0, -0.5, 0.0]), np.array(end, dtype=float)
    cone = draw(shapes(cones=([start], [end], np.array([radii]), WHITE)), Look(**PLAIN))
    t = np.linspace(0, 1, 4000)[:, None]
    along = spheres(start + t * (end - start), (radii[0] + t * (radii[1] - radii[0]))[:, 0])
    many = draw(along, Look(**PLAIN))
    difference = np.abs(cone.array.astype(int) - many.array).max(axis=2)
    # Steps of 1/4000 turn the normal by less than a level, but for grazing rays at the edge.
    assert (difference > 2).mean() < 2e-3


def test_what_is_behind_or_around_the_camera_is_not_drawn(cover):
    for position, radius in [((0, 0, 14), 1.0), ((0, 0, 10), 3.0), ((0, 0, 0), 0.0)]:
        assert cover(spheres(position, radius)).sum() == 0
    assert cover(shapes(cones=([(0, 0, 12)], [(0, 0, 30)], 1.0, WHITE))).sum() == 0


def test_a_sphere_through_the_camera_plane_is_drawn_where_it_is(cover):
    # Beside the camera, at theta = 90 degrees; seen from theta - phi on, with sin phi = 2 / 3.
    mask = cover(spheres((3, 0, 10), 2.0), width=1280)
    first = np.tan(np.pi / 2 - np.arcsin(2 / 3)) * FOCUS + 640
    assert np.flatnonzero(mask[HEIGHT // 2])[0] == pytest.approx(first, abs=1.0)


def test_an_empty_scene_is_background(draw):
    picture = draw(Geometry(), Look(background=(0.2, 0.4, 0.6))).array
    expected = np.rint(255 * colors.encoded(np.array([0.2, 0.4, 0.6])))
    assert (picture == expected).all()


@pytest.mark.parametrize(
    "arguments",
    [
        {"target": (0, 0, 10)},
        {"up": (0, 0, 1)},
        {"up": (0, 0, 0)},
        {"field_of_view": 0},
        {"field_of_view": 180},
        {"position": (0, 0)},
    ],
)
def test_a_camera_refuses_what_shows_nothing(arguments, refused):
    with refused(next(iter(arguments))):
        ps.Camera(**{"position": (0, 0, 10), "target": (0, 0, 0), **arguments})


@pytest.mark.parametrize("up", [(0, 1, 0), (0, 0, 1), (1, 0, 0)])
def test_the_automatic_camera_sees_all_and_not_much_more(up):
    x = np.random.default_rng(0).uniform((-1, -2, -3), (4, 5, 6), (50, 3))
    camera = ps.Camera.around(x, up, 16 / 9)
    right, high, back = ((x - camera.position) @ camera.axes.T).T
    across, above = -right / back / (camera.slope * 16 / 9), -high / back / camera.slope
    reached = np.array([[each.min(), each.max()] for each in (across, above)])
    # All within 1 / 1.05 of the picture; one direction uses that on both sides, the other has room.
    np.testing.assert_allclose(np.abs(reached).max(), 1 / 1.05)
    assert any(np.allclose(side, (-1 / 1.05, 1 / 1.05)) for side in reached)
    assert camera.axes[1] @ up > 0


def test_the_automatic_camera_minds_radii(cover):
    geometry = spheres((3, 2, 1), 2.0)
    mask = cover(geometry, camera=ps.Camera.around([(3, 2, 1)], (0, 1, 0), WIDTH / HEIGHT, 2.0))
    rows = np.flatnonzero(mask.any(axis=1))
    # The sphere touches the lines of 1 / 1.05 of the height, seen from its own middle's direction.
    assert rows[0] == pytest.approx(0.5 * HEIGHT * (1 - 1 / 1.05), abs=1.5)
    assert rows[-1] == pytest.approx(0.5 * HEIGHT * (1 + 1 / 1.05), abs=1.5)
