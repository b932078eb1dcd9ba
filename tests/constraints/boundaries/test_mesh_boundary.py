"""Meshes: closed ones against boxes and spheres, sheets that nothing goes through, refusals."""

import numpy as np
import pytest

import particlesim as ps

G = 9.81
CORNERS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
CUBE = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
        (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]  # fmt: skip
SQUARE = [(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)], [(0, 1, 2), (0, 2, 3)]


def cube_distance(x):
    """From the surface of the cube, positive outside."""
    q = np.abs(x) - 1
    return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0)


@pytest.mark.parametrize("inside", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_distance_of_a_cube(inside):
    """Exact in float64, from either side and however its triangles go round."""
    x, aside = np.random.default_rng(0).uniform(-2, 2, (2000, 3)), np.array([5, 0, 0])
    for triangles in (CUBE, np.array(CUBE)[:, ::-1]):
        mesh = ps.MeshBoundary(CORNERS + aside, triangles, inside)
        found = mesh.distance(x + aside)
        assert np.allclose(found, cube_distance(x) * (-1 if inside else 1), atol=1e-14)


@pytest.mark.parametrize("precision", ["float32", pytest.param("float64", marks=pytest.mark.slow)])
def test_projection_out_of_a_cube(precision, device, simulate, scene_of):
    """From outside to R off the nearest point, also 10 km from the origin; what is off stays."""
    rng = np.random.default_rng(0)
    x, radius = rng.uniform(-1.5, 1.5, (300, 3)), rng.uniform(0, 0.3, 300)
    out = cube_distance(x) > 0
    x, radius = x[out], radius[out]
    nearest = np.clip(x, -1, 1)
    way = x - nearest
    r = np.linalg.norm(way, axis=1, keepdims=True)
    expected = nearest + way / r * np.maximum(r, radius[:, None])
    eps = np.finfo(precision).eps
    mesh = ps.MeshBoundary(CORNERS, CUBE, friction=0.5)
    sim = simulate(scene_of(x, mesh, radius=radius), device, precision=precision)
    sim.project(1)
    # Directions of what is close by: r is rounded to eps, and is known to eps / r.
    far = r[:, 0] > 1e-3
    assert np.allclose(sim.position[far], expected[far], atol=1e4 * eps)
    assert (cube_distance(sim.position) - radius).min() > -20 * eps


@pytest.mark.slow
@pytest.mark.parametrize("motion", [{}, {"velocity": (0.5, 0.3, 0), "angular_velocity": (1, 2, 3)}])
def test_inside_a_cube_as_inside_a_box(motion, precision, device, simulate, scene_of):
    """At rest and in motion, rough and bouncing, until something meets an edge."""
    rng = np.random.default_rng(1)
    x = rng.uniform(-0.5, 0.5, (200, 3))
    v = rng.normal(0, 3, (200, 3))
    touch = {"friction": 0.4, "restitution": 0.6, **motion}
    found = []
    for boundary in (
        ps.BoxBoundary((-1, -1, -1), (1, 1, 1), **touch),
        ps.MeshBoundary(CORNERS, CUBE, inside=True, **touch),
    ):
        scene = scene_of(x, boundary, velocity=v, radius=0.05, gravity=True)
        sim = simulate(scene, device, precision=precision)
        sim.run(30)
        found.append(sim.position)
    # 30 steps of some roundings of places and velocities; a bounce divides by the step.
    eps = np.finfo(precision).eps
    same = np.abs(found[0] - found[1]).max(axis=1) < 1e5 * eps
    assert same.mean() > 0.8


@pytest.mark.slow
def test_rest_far_from_the_origin(device, simulate, scene_of):
    """10 km away in float32, on a face and in a corner."""
    far = 1e4
    mesh = ps.MeshBoundary(CORNERS + far, CUBE, inside=True, friction=0.5)
    x = np.array([(0, -0.75, 0), (-0.75, -0.75, 0.75)]) + far
    sim = simulate(scene_of(x, mesh, radius=0.25, gravity=True), device, dt=1 / 60, substeps=20,
                   precision="float32")  # fmt: skip
    sim.run(60)
    assert np.abs(sim.velocity).max() < 1e-3
    assert np.allclose(sim.position, x, atol=2e-3)  # places are 1e-3 apart


@pytest.mark.slow
@pytest.mark.parametrize("speed", [1.0, 30.0, 1e3, 1e6])
def test_nothing_goes_through_a_sheet(speed, precision, device, simulate, scene_of):
    """From either side, however far beyond a substep would have led, and with other constraints."""
    rng = np.random.default_rng(2)
    x = rng.uniform(-0.9, 0.9, (100, 3))
    side = np.sign(x[:, 1])
    x[:, 1] += 0.2 * side
    v = rng.uniform(0.1, 1, (100, 1)) * speed * np.array([0, -1, 0]) * side[:, None]
    sheet = ps.MeshBoundary(*SQUARE, sheet=True, restitution=0.5)
    sim = simulate(scene_of(x, sheet, velocity=v, radius=0.05), device, precision=precision)
    for _ in range(4):
        sim.step()
        assert (np.sign(sim.position[:, 1]) == side).all()
        # Brought back from a place of v h, which is rounded.
        rounding = 4 * np.finfo(precision).eps * (1 + speed * 0.01)
        assert np.abs(sim.position[:, 1]).min() >= 0.05 - rounding
    # It came back to half its speed, off from the sheet: to the rounding of v + correction / h.
    hit = np.abs(v[:, 1]) * 0.03 > np.abs(x[:, 1])
    came = sim.velocity[hit, 1] / v[hit, 1]
    assert np.allclose(came, -0.5, atol=1e-3)


@pytest.mark.slow
def test_nothing_goes_through_a_thin_wall(device, simulate, scene_of):
    """A closed plate of a millimetre, passed by a metre in one substep."""
    plate = ps.MeshBoundary(CORNERS * [1, 5e-4, 1], CUBE)
    x, v = [(0.3, 0.5, 0.1)], (0, -150.0, 0)
    sim = simulate(scene_of(x, plate, velocity=v, radius=0.01), device)
    sim.run(3)
    assert sim.position[0, 1] == pytest.approx(0.0105, abs=1e-12)


@pytest.mark.slow
def test_a_projection_outside_of_time(device, simulate, scene_of):
    """Particles written to the other side of a sheet are not brought back through it."""
    sheet = ps.MeshBoundary(*SQUARE, sheet=True)
    sim = simulate(scene_of([(0, 0.2, 0)], sheet, radius=0.05), device)
    sim.run(2)
    sim.position = [(0.3, -0.01, 0.1)]
    sim.project(1)
    assert sim.position[0] == pytest.approx([0.3, -0.05, 0.1], abs=1e-12)
    sim.run(2)
    assert sim.position[0, 1] == pytest.approx(-0.05, abs=1e-12)


@pytest.mark.slow
def test_where_there_is_no_room_the_middle_is_right(device, simulate, scene_of):
    channel = ps.MeshBoundary(CORNERS * [1, 0.05, 1], CUBE, inside=True)
    sim = simulate(scene_of([(0.3, 0.02, 0.2)], channel, radius=0.1, gravity=True), device)
    sim.run(100)
    assert sim.position[0] == pytest.approx([0.3, 0, 0.2], abs=2e-3)
    assert np.abs(sim.velocity).max() < 0.2


@pytest.mark.slow
@pytest.mark.parametrize("inside", [False, True])
def test_what_starts_in_the_solid_is_brought_out(inside, device, simulate, scene_of):
    """Slowly, to the nearest point; overlapping obstacles are one solid."""
    both = np.concatenate([CORNERS, CORNERS + np.array([0.8, 0.1, 0.0])])
    corners, faces = (CORNERS, CUBE) if inside else (both, [*CUBE, *(np.array(CUBE) + 8)])
    mesh = ps.MeshBoundary(corners, faces, inside)
    x = [(2.5, 0.3, 0.2)] if inside else [(0.2, 0.7, 0.1), (-0.9, 0.1, 0.2), (1.75, 0.3, 0.1)]
    sim = simulate(scene_of(x, mesh, radius=0.1), device, substeps=2)
    fastest = 0.0
    for _ in range(1500):
        sim.step()
        fastest = max(fastest, float(np.abs(sim.velocity).max()))
    assert mesh.distance(sim.position).min() > 0.1 - 1e-6
    assert fastest < 11  # a radius a frame of 0.01 at most


@pytest.mark.slow
def test_a_sheet_that_moves_takes_along(device, simulate, scene_of):
    """A paddle that sweeps faster than a diameter in a substep."""
    sheet = ps.MeshBoundary(*SQUARE, sheet=True, velocity=(0, 20, 0))
    sim = simulate(scene_of([(0, 0.5, 0)], sheet, radius=0.05), device)
    sim.run(20)
    assert sim.position[0, 1] == pytest.approx(20 * 0.2 + 0.05, abs=1e-9)
    assert sim.velocity[0, 1] == pytest.approx(20, abs=1e-9)


@pytest.mark.slow
def test_slope_of_triangles_holds_below_the_friction_angle(device, simulate, scene_of):
    """A grain lies still at tan = 0.99 mu, and slides at g (sin - mu cos) beyond."""
    mu = 0.5
    for factor in (0.99, 1.2):
        angle = np.arctan(factor * mu)
        turn = np.array([(np.cos(angle), -np.sin(angle), 0), (np.sin(angle), np.cos(angle), 0),
                         (0, 0, 1)])  # fmt: skip
        sheet = ps.MeshBoundary(20 * np.array(SQUARE[0]) @ turn.T, SQUARE[1], sheet=True,
                                friction=mu)  # fmt: skip
        start = turn @ [5, 0.1, 0.3]
        sim = simulate(scene_of([start], sheet, radius=0.1, gravity=True), device, substeps=10)
        sim.run(100)
        way = np.linalg.norm(sim.position[0] - start)
        a = max(G * (np.sin(angle) - mu * np.cos(angle)), 0.0)
        # Symplectic Euler is h / t ahead.
        assert way == pytest.approx(0.5 * a * sim.time**2, rel=2e-3, abs=1e-9)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"triangles": CUBE[:-1]}, "close a surface"),
        ({"triangles": [*CUBE[:-1], CUBE[-1][::-1]]}, "close a surface"),
        ({"triangles": [*CUBE, (0, 1, 1)]}, "three different corners"),
        ({"triangles": [*CUBE, (0, 1, 8)]}, "indices from 0 to 7"),
        ({"vertices": CORNERS * [1, 0, 1]}, "have an area"),
        ({"sheet": True, "inside": True}, "be False of a sheet"),
    ],
)
def test_refusals(change, told):
    with pytest.raises(ValueError, match=f"MeshBoundary: .*{told}"):
        ps.MeshBoundary(**{"vertices": CORNERS, "triangles": CUBE} | change)


def test_points_need_a_thickness(device, simulate, scene_of):
    with pytest.raises(ValueError, match="thickness must be above 0"):
        simulate(scene_of([(0, 1, 0)], ps.MeshBoundary(*SQUARE, sheet=True)), device)
