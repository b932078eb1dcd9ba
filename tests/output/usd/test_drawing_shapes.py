"""What recordings draw of surfaces, of links that break and of boundaries that move."""

import numpy as np
import pytest
from pxr import UsdGeom

import particlesim as ps
from cases.strip import squares, strip

from .drawn import SETTINGS, flying, names, pool, record
from .recordings import checked, value

# Meshes -----------------------------------------------------------------------------------------


def cloth(size=4):
    """A square of particles in the plane y = 1, its triangles and its edges along the axes."""
    at = np.stack(np.meshgrid(*2 * [np.arange(size)], indexing="ij"), axis=-1).reshape(-1, 2)
    position = np.stack([at[:, 0], np.ones(size**2), at[:, 1]], axis=1)
    index = np.arange(size**2).reshape(size, size)
    faces = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    a, b, c, d = (corner.ravel() for corner in faces)
    triangles = np.concatenate([np.stack([a, d, c], 1), np.stack([a, c, b], 1)])
    edges = np.concatenate([
        np.stack([index[:-1].ravel(), index[1:].ravel()], 1),
        np.stack([index[:, :-1].ravel(), index[:, 1:].ravel()], 1),
    ])  # fmt: skip
    return position, triangles, edges


def test_a_group_with_triangles_is_a_mesh(tmp_path, device):
    position, triangles, edges = cloth()
    scene = ps.Scene()
    scene.add_particles([(0, 5, 0)], group="bob", radius=0.1)
    sheet = scene.add_particles(position, triangles=triangles, group="sheet", radius=0.1)
    scene.add_interaction(ps.UniformGravity())
    scene.add_constraint(ps.Distance(np.concatenate([sheet[edges], [(0, sheet[0])]])))
    sim = ps.Simulation(scene, SETTINGS, device=device, worlds=2)
    states, velocities = record(sim, tmp_path / "out.usda", 2, fields=["speed"])
    stage = checked(tmp_path / "out.usda")
    assert names(stage, "Points") == ["env_0000/bob", "env_0001/bob"]
    assert names(stage, "Mesh") == ["env_0000/sheet", "env_0001/sheet"]
    for w, frame in np.ndindex(2, 3):
        sheet_rows = slice(17 * w + 1, 17 * w + 17)
        prim = f"/World/env_000{w}/sheet"
        found = value(stage, f"{prim}.points", frame)
        np.testing.assert_array_equal(found, states[frame, sheet_rows])
        v = value(stage, f"{prim}.velocities", frame)
        np.testing.assert_array_equal(v, velocities[frame, sheet_rows])
    np.testing.assert_array_equal(
        value(stage, "/World/env_0000/sheet.faceVertexIndices", 0), triangles.ravel()
    )
    # Flat at the start, and seen from above: a, d, c turns counterclockwise about +y.
    np.testing.assert_allclose(
        value(stage, "/World/env_0001/sheet.normals", 0), np.tile((0, 1, 0), (16, 1)), atol=1e-6
    )
    # Edges of the mesh are not drawn once more; what hangs on it is.
    assert len(value(stage, "/World/env_0000/Distance.points", 0)) == 2


@pytest.mark.parametrize(
    ("triangles", "match"),
    [
        ([(0, 1)], r"triangles must be whole numbers of shape \(t, 3\)"),
        ([(0.0, 1.0, 2.0)], "triangles must be whole numbers"),
        ([], "triangles must be whole numbers"),
        (np.zeros((0, 3), int), "triangles must be whole numbers"),
        ([(0, 1, 3)], "triangles must hold indices from 0 to 2, got 3"),
        ([(0, 1, -1)], "triangles must hold indices from 0 to 2, got -1"),
        ([(0, 1, 2), (2, 1, 2)], r"triangles\[1\] must have three different corners"),
    ],
)
def test_triangles_that_are_none_are_refused(refused, triangles, match):
    scene = ps.Scene()
    with refused(match):
        scene.add_particles(np.eye(3), triangles=triangles)
    assert scene.particle_count == 0
    assert scene.add_particles(np.eye(3)).triangles is None


def test_a_fluid_is_drawn_as_its_surface(tmp_path, device):
    pytest.importorskip("pysplashsurf")
    sim = ps.Simulation(pool(), ps.Settings(dt=0.01, substeps=2), device=device, worlds=2)
    record(sim, tmp_path / "out.usda", 1, surface={"spacing": 0.2, "smooth": 0})
    stage = checked(tmp_path / "out.usda")
    assert names(stage, "Points") == ["env_0000/duck", "env_0001/duck"]
    assert names(stage, "Mesh") == ["env_0000/water", "env_0001/water"]
    for frame in (0, 1):
        mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/World/env_0001/water"))
        points = np.array(mesh.GetPointsAttr().Get(frame), dtype=float)
        a, b, c = points[np.array(mesh.GetFaceVertexIndicesAttr().Get(frame)).reshape(-1, 3).T]
        volume = np.sum(a * np.cross(b, c)) / 6
        # A unit cube whose corners and edges are rounded over about a particle spacing, 0.2:
        # at most 12 edges of (1 - pi/4) 0.2^2 each.
        assert 1 - 12 * (1 - np.pi / 4) * 0.2**2 < volume < 1.1


# What moves or breaks ---------------------------------------------------------------------------


def test_broken_links_are_not_drawn(tmp_path, device):
    # Two weights on threads: one holds, one does not.
    scene = ps.Scene()
    ends = scene.add_particles(
        [(0, 1, 0), (0, 0, 0), (1, 1, 0), (1, 0, 0)], mass=[1, 1, 1, 9],
        pinned=[True, False, True, False],
    )  # fmt: skip
    scene.add_interaction(ps.UniformGravity((0, -10, 0)))
    scene.add_constraint(ps.Distance(ends.indices.reshape(2, 2), break_force=30.0))
    sim = ps.Simulation(scene, ps.Settings(dt=1 / 32, substeps=4), device=device, worlds=2)
    states, _ = record(sim, tmp_path / "out.usda", 4)
    assert sim.constraints[0].broken.tolist() == [False, True] * 2
    stage = checked(tmp_path / "out.usda")
    for w in (0, 1):
        thread = f"/World/env_000{w}/Distance"
        counts = [len(value(stage, f"{thread}.curveVertexCounts", f)) for f in range(5)]
        assert counts == [2, 1, 1, 1, 1]
        np.testing.assert_array_equal(
            value(stage, f"{thread}.points", 4), states[4, 4 * w : 4 * w + 2]
        )


def test_torn_triangles_are_not_drawn(tmp_path, device):
    scene, weak = strip()
    sim = ps.Simulation(scene, ps.Settings(dt=1 / 32, substeps=4), device=device, worlds=2)
    states, velocities = record(sim, tmp_path / "out.usda", 2, fields=["speed"])
    assert (sim.constraints[0].broken == np.tile(weak, 2)).all()
    stage = checked(tmp_path / "out.usda")
    assert names(stage, "Mesh") == ["env_0000/strip", "env_0001/strip"]
    for w in (0, 1):
        prim = f"/World/env_000{w}/strip"
        counts = [len(value(stage, f"{prim}.faceVertexCounts", f)) for f in range(3)]
        assert counts == [6, 4, 4]
        left = np.reshape(value(stage, f"{prim}.faceVertexIndices", 2), (-1, 3))
        assert squares(left) == [0, 0, 2, 2]
        rows = slice(8 * w, 8 * w + 8)
        np.testing.assert_array_equal(value(stage, f"{prim}.points", 2), states[2, rows])
        np.testing.assert_array_equal(value(stage, f"{prim}.velocities", 2), velocities[2, rows])
        assert len(value(stage, f"{prim}.primvars:speed", 2)) == 8


def test_boundaries_that_move_have_their_transforms(tmp_path, device):
    scene = flying()
    scene.add_constraint(ps.PlaneBoundary((0, -50, 0), (0, 1, 0), velocity=(0, 0.5, 0)))
    turning = {"angular_velocity": (0, 0, 16 * np.pi)}  # a quarter a frame
    scene.add_constraint(ps.BoxBoundary((-90, -90, -90), (90, 90, 90), **turning))
    scene.add_constraint(ps.PlaneBoundary((0, -60, 0), (0, 1, 0)))
    sim = ps.Simulation(scene, SETTINGS, device=device, worlds=2)
    with ps.UsdRecorder(sim, tmp_path / "out.usda", frames=3) as out:
        for frame in range(4):
            if frame == 2:
                sim.reset([1])  # its clock starts again, the file's does not
            out.write()
            sim.step()
    stage = checked(tmp_path / "out.usda")
    cache = UsdGeom.XformCache()
    for w, times in enumerate([(0, 1, 2, 3), (0, 1, 0, 1)]):
        room = f"/World/env_000{w}/boundaries"
        for code, time in enumerate(times):
            cache.SetTime(code)
            plane, box, still = (
                np.array(cache.GetLocalToWorldTransform(stage.GetPrimAtPath(f"{room}/{name}")))
                for name in ("PlaneBoundary", "BoxBoundary", "PlaneBoundary_2")
            )
            np.testing.assert_allclose(plane[3, :3], (0, 0.5 * time / 32, 0), atol=1e-12)
            turned = np.linalg.matrix_power([[0, -1, 0], [1, 0, 0], [0, 0, 1]], time)
            np.testing.assert_allclose(box[:3, :3].T, turned, atol=1e-9)
            np.testing.assert_array_equal(still, np.eye(4))


# What is refused --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"worlds": [2]}, r"worlds must be some of 0 to 1, got \[2\]"),
        ({"worlds": []}, "worlds must be some of"),
        ({"groups": ["c"]}, "groups must be one of a, b, got 'c'"),
        ({"layout": "circle"}, "layout must be one of grid"),
        ({"layout": (1, 2)}, r"layout must have shape \(3,\)"),
        ({"every": 0}, "every must be a whole number of at least 1"),
        ({"color_by": "heat"}, "field must be one of .*charge"),
        ({"color_by": "speed", "color_map": "jet"}, "color_map must be one of viridis"),
        ({"color_by": "speed", "color_range": 3}, r"color_range must be \(lower, upper\)"),
        ({"color_by": "speed", "color_range": (3, 3)}, "color_range upper must be above 3"),
        ({"fields": ["density"]}, "field must be one of"),
        ({"fields": ["velocity"]}, "fields must have another name"),
        ({"surface": True}, "surface must be False in a scene without SPH"),
        ({"groups": []}, "points must hold a group, or meshes a surface"),
    ],
)
def test_choices_that_make_no_sense_are_refused(tmp_path, refused, options, match):
    sim = ps.Simulation(flying(), SETTINGS, device="cpu", worlds=2)
    with refused(match):
        ps.UsdRecorder(sim, tmp_path / "out.usda", **options)
    assert list(tmp_path.iterdir()) == []
