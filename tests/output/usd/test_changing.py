"""Recordings of what changes from frame to frame: counts, links, meshes, poses, widths, colours."""

import numpy as np
import pytest
from pxr import Gf, Sdf, UsdGeom, UsdShade

from particlesim.output.usd.description import LinksPrim, MeshPrim, Shape, StageInfo
from particlesim.output.usd.shapes import Shape as SameShape
from particlesim.output.usd.writing.frame import vertex_normals
from particlesim.output.usd.writing.writer import UsdWriter

from .recordings import (
    BLUE,
    COUNT,
    RED,
    ROOM,
    checked,
    group,
    motion,
    value,
)


def tetrahedron():
    points = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype=np.float32)
    return points, np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])


# Counts that change ---------------------------------------------------------------------------


@pytest.mark.parametrize("instancer", [False, True])
def test_particles_come_and_go(tmp_path, instancer):
    # Arrays of another length in every frame, of which some rows are drawn, in an order of theirs.
    spray = group(indices=None, ids=None, instancer=instancer)
    rng, counts = np.random.default_rng(3), [3, 8, 0, 5]
    written = []
    with UsdWriter(
        tmp_path / "out.usda", StageInfo(points=[spray], frames=4), fields={"age": 1}
    ) as out:
        for frame, count in enumerate(counts):
            x, v = rng.normal(size=(2, count + 2, 3)).astype(np.float32)
            rows, ids = rng.permutation(count + 2)[:count], rng.permutation(20)[:count]
            age = rng.random(count + 2).astype(np.float32)
            out.write(frame, x, v, {"age": age}, rows={spray: (rows, ids)})
            written.append((x[rows], v[rows], ids, age[rows]))
    stage = checked(tmp_path / "out.usda")
    points = "positions" if instancer else "points"
    for frame, expected in enumerate(written):
        for name, array in zip(
            (points, "velocities", "ids", "primvars:age"), expected, strict=True
        ):
            found = value(stage, f"{ROOM}/water.{name}", frame)
            np.testing.assert_array_equal(found.reshape(array.shape), array)
        np.testing.assert_array_equal(
            value(stage, f"{ROOM}/water.primvars:pid", frame), expected[2]
        )


def test_bounds_of_nothing_are_empty(tmp_path):
    spray = group(indices=None, ids=None)
    with UsdWriter(tmp_path / "out.usda", StageInfo(points=[spray])) as out:
        nothing = np.zeros((0, 3))
        out.write(0, nothing, nothing, rows={spray: ([], [])})
    stage = checked(tmp_path / "out.usda")
    bound = UsdGeom.BBoxCache(0, ["default"]).ComputeLocalBound(
        stage.GetPrimAtPath(f"{ROOM}/water")
    )
    assert bound.GetRange().IsEmpty()


def test_links_come_and_go(tmp_path):
    position, velocity = motion(3)
    rope = LinksPrim(0, "rope", None, 0.05, RED)
    pairs = [np.array([[0, 1], [1, 2], [2, 3]]), np.array([[0, 1]]), np.zeros((0, 2), int)]
    with UsdWriter(
        tmp_path / "out.usda", StageInfo(points=[group()], links=[rope], frames=3)
    ) as out:
        for frame in range(3):
            out.write(frame, position[frame], velocity[frame], pairs={rope: pairs[frame]})
    stage = checked(tmp_path / "out.usda")
    for frame in range(3):
        counts = value(stage, f"{ROOM}/rope.curveVertexCounts", frame)
        assert counts.tolist() == [2] * len(pairs[frame])
        ends = value(stage, f"{ROOM}/rope.points", frame).reshape(-1, 2, 3)
        np.testing.assert_array_equal(ends, position[frame][pairs[frame]])


# Meshes ---------------------------------------------------------------------------------------


def test_surfaces_whose_triangles_change(tmp_path):
    points, triangles = tetrahedron()
    skin = MeshPrim(0, "skin", BLUE)
    given = [
        (points, triangles, points - 0.25),
        (points[:3] + 1, triangles[:1], np.tile((0, 0, -1), (3, 1))),
        (np.zeros((0, 3)), np.zeros((0, 3), int), np.zeros((0, 3))),
    ]
    with UsdWriter(tmp_path / "out.usda", StageInfo(meshes=[skin], frames=3)) as out:
        for frame, mesh in enumerate(given):
            out.write(frame, np.zeros((0, 3)), np.zeros((0, 3)), meshes={skin: mesh})
    stage = checked(tmp_path / "out.usda")
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath(f"{ROOM}/skin"))
    assert mesh.GetSubdivisionSchemeAttr().Get() == UsdGeom.Tokens.none
    assert mesh.GetDoubleSidedAttr().Get() and mesh.GetNormalsInterpolation() == "vertex"
    for frame, (points, triangles, normals) in enumerate(given):
        found = [mesh.GetPointsAttr(), mesh.GetFaceVertexIndicesAttr(), mesh.GetNormalsAttr()]
        for attribute, expected in zip(found, (points, triangles, normals), strict=True):
            array = np.array(attribute.Get(frame)).reshape(expected.shape)
            np.testing.assert_array_equal(array, expected)
        assert list(mesh.GetFaceVertexCountsAttr().Get(frame)) == [3] * len(triangles)


def test_surfaces_spanned_by_particles(tmp_path):
    # A tetrahedron that turns by a quarter a frame about z: its normals turn with it.
    points, triangles = tetrahedron()
    skin = MeshPrim(0, "skin", BLUE, slice(2, 6), triangles)
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]], dtype=np.float32)
    x = np.concatenate([np.full((2, 3), 9), points])
    with UsdWriter(
        tmp_path / "out.usda", StageInfo(meshes=[skin], frames=2, fps=1), fields={"heat": 1}
    ) as out:
        for frame in range(2):
            heat = np.arange(6.0) + frame
            out.write(frame, x, x @ turn.T - x, {"heat": heat})
            x = x @ turn.T
    stage = checked(tmp_path / "out.usda")
    normals = [value(stage, f"{ROOM}/skin.normals", frame) for frame in range(2)]
    np.testing.assert_allclose(normals[1], normals[0] @ turn.T, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(normals[0], axis=1), 1, rtol=1e-6)
    # They point out of the tetrahedron, whose middle is (1, 1, 1) / 4.
    assert (np.sum(normals[0] * (points - 0.25), axis=1) > 0).all()
    now, ahead = (value(stage, f"{ROOM}/skin.points", frame) for frame in (0, 1))
    moved = now + value(stage, f"{ROOM}/skin.velocities", 0)  # one frame a second
    np.testing.assert_array_equal(moved, ahead)
    np.testing.assert_array_equal(value(stage, f"{ROOM}/skin.primvars:heat", 1), np.arange(3, 7))


def test_vertex_normals_weigh_by_area():
    # An L of two faces at a right angle, one twice as large: the normal on the shared edge is
    # (1, 0, 2) / sqrt(5) by areas, whatever the triangulation.
    points = np.array([(0, 0, 0), (0, 1, 0), (2, 0, 0), (2, 1, 0), (0, 0, -1), (0, 1, -1)], float)
    triangles = np.array([(0, 2, 1), (2, 3, 1), (0, 1, 4), (1, 5, 4)])
    at = vertex_normals(points, triangles)
    # Corner 0 has one triangle of each face, of area 1 and 1/2.
    np.testing.assert_allclose(at[0], np.array([-1, 0, 2]) / np.sqrt(5), rtol=1e-6)
    # Points without area around them have a direction all the same.
    flat = vertex_normals(np.zeros((4, 3)), np.array([(0, 1, 2)]))
    np.testing.assert_allclose(np.linalg.norm(flat, axis=1), 1)


# Boundaries that move ---------------------------------------------------------------------------


def test_moving_shapes_have_their_transforms_in_the_clips(tmp_path):
    assert Shape is SameShape
    points, triangles = tetrahedron()
    shapes = [
        Shape("plane", ((0, -1, 0), (0, 1, 0)), moving=True),
        Shape("box", ((-1, -1, -1), (1, 1, 1)), moving=True),
        Shape("sphere", ((3, 0, 0), 0.5), moving=True),
        Shape("mesh", (points, triangles), moving=True),
        Shape("box", ((-2, -2, -2), (2, 2, 2)), name="still"),
    ]
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    position, velocity = motion(3)
    with UsdWriter(
        tmp_path / "out.usda", StageInfo(points=[group()], shapes=shapes, frames=3)
    ) as out:
        for frame in range(3):
            pose = ((0.5 * frame, 0, 0), np.linalg.matrix_power(turn, frame))
            poses = {shape: pose for shape in shapes[:4]}
            out.write(frame, position[frame], velocity[frame], poses=poses)
    stage = checked(tmp_path / "out.usda")
    cache = UsdGeom.XformCache()
    for frame in range(3):
        cache.SetTime(frame)
        for name in ("plane", "box", "sphere", "mesh"):
            prim = stage.GetPrimAtPath(f"{ROOM}/boundaries/{name}")
            found = cache.GetLocalToWorldTransform(prim).Transform(Gf.Vec3d(1, 2, 3))
            expected = np.linalg.matrix_power(turn, frame) @ (1, 2, 3) + (0.5 * frame, 0, 0)
            np.testing.assert_allclose(found, expected, atol=1e-12)
        still = stage.GetPrimAtPath(f"{ROOM}/boundaries/still")
        assert cache.GetLocalToWorldTransform(still) == Gf.Matrix4d(1)


@pytest.mark.parametrize(
    ("pose", "match"),
    [
        (((0, 0, 0), 2 * np.eye(3)), "rotation of 'box' must turn and not stretch"),
        (((0, 0, 0), np.diag([1, 1, -1])), "rotation of 'box' must turn and not stretch"),
        (((0, np.nan, 0), np.eye(3)), r"translation of 'box'\[1\] must be finite"),
    ],
)
def test_poses_that_are_none_are_refused(tmp_path, refused, pose, match):
    box = Shape("box", ((0, 0, 0), (1, 1, 1)), moving=True)
    out = UsdWriter(tmp_path / "out.usda", StageInfo(points=[group()], shapes=[box]))
    with refused(match):
        out.write(0, *motion(1)[:, 0], poses={box: pose})
    assert list(tmp_path.iterdir()) == []


# Values that USD has itself ---------------------------------------------------------------------


@pytest.mark.parametrize("instancer", [False, True])
def test_widths_and_colors_may_be_fields(tmp_path, instancer):
    position, velocity = motion(2)
    rng = np.random.default_rng(5)
    widths, shade = rng.random((2, COUNT)), rng.random((2, COUNT, 3))
    fields = {"widths": 1, "displayColor": "color", "world": "int"}
    info = StageInfo(points=[group(instancer=instancer)], frames=2)
    with UsdWriter(tmp_path / "out.usda", info, fields=fields) as out:
        for k in range(2):
            values = {"widths": widths[k], "displayColor": shade[k], "world": np.arange(COUNT) - k}
            out.write(k, position[k], velocity[k], values)
    stage = checked(tmp_path / "out.usda")
    prim = stage.GetPrimAtPath(f"{ROOM}/water")
    kinds = {p.GetPrimvarName(): str(p.GetTypeName()) for p in
             UsdGeom.PrimvarsAPI(prim).GetPrimvars()}  # fmt: skip
    assert kinds["displayColor"] == "color3f[]" and kinds["world"] == "int[]"
    for k in range(2):
        found = value(stage, f"{ROOM}/water.primvars:displayColor", k)
        np.testing.assert_array_equal(found, shade[k].astype(np.float32))
        found = value(stage, f"{ROOM}/water.primvars:world", k)
        np.testing.assert_array_equal(found, np.arange(COUNT) - k)
        expected = widths[k].astype(np.float32)
        if instancer:  # of a sphere of diameter 1
            expected = np.repeat(expected[:, None], 3, axis=1)
        name = "scales" if instancer else "widths"
        np.testing.assert_array_equal(value(stage, f"{ROOM}/water.{name}", k), expected)
    # Renderers find the colours through the material.
    seen = stage.GetPrimAtPath(f"{ROOM}/water/prototypes/ball") if instancer else prim
    shader = UsdShade.MaterialBindingAPI(seen).ComputeBoundMaterial()[0].ComputeSurfaceSource()[0]
    (source,) = shader.GetInput("diffuseColor").GetConnectedSources()[0]
    assert UsdShade.Shader(source.source).GetInput("varname").Get() == "displayColor"


@pytest.mark.parametrize("widths", [0.25, np.linspace(0.1, 0.3, COUNT)], ids=["one", "each"])
def test_instances_are_spheres_of_the_particles_size(tmp_path, widths):
    position, velocity = motion(2)
    info = StageInfo(points=[group(widths=widths, instancer=True)], frames=2)
    with UsdWriter(tmp_path / "out.usda", info) as out:
        for k in range(2):
            out.write(k, position[k], velocity[k])
    stage = checked(tmp_path / "out.usda")
    instancer = UsdGeom.PointInstancer(stage.GetPrimAtPath(f"{ROOM}/water"))
    assert list(instancer.GetIdsAttr().Get()) == list(range(COUNT))
    ball = UsdGeom.Mesh(stage.GetPrimAtPath(instancer.GetPrototypesRel().GetTargets()[0]))
    radius = np.linalg.norm(np.array(ball.GetPointsAttr().Get()), axis=1)
    for k in range(2):
        found = instancer.ComputeInstanceTransformsAtTime(k, k)
        np.testing.assert_allclose([m.ExtractTranslation() for m in found], position[k], rtol=1e-6)
        size = np.array([m[0][0] for m in found]) * 2 * radius.mean()
        np.testing.assert_allclose(size, np.broadcast_to(widths, COUNT), rtol=1e-5)
        # Each sphere touches the planes of its box: the mesh has points there.
        np.testing.assert_allclose(
            np.array(instancer.GetExtentAttr().Get(k)),
            [(position[k].T - size / 2).min(axis=1), (position[k].T + size / 2).max(axis=1)],
            rtol=1e-5,
        )


def test_notes_are_kept_in_the_frames_file(tmp_path):
    with UsdWriter(tmp_path / "out.usda", StageInfo(points=[group()], frames=2)) as out:
        out.write(0, *motion(1)[:, 0], notes={"colorBy": "speed", "colorUpper": 2.5})
        out.write(1, *motion(1)[:, 0])
    layers = [Sdf.Layer.FindOrOpen(str(tmp_path / f"out.clips/f.00000{k}.usdc")) for k in (0, 1)]
    assert layers[0].customLayerData == {"particlesim": {"colorBy": "speed", "colorUpper": 2.5}}
    assert layers[1].customLayerData == {}


def test_the_layout_moves_worlds_and_not_points(tmp_path):
    position, velocity = motion(1)
    points = [group(world=w, indices=slice(6 * w, 6 * w + 6), ids=np.arange(6)) for w in (0, 1)]
    box = ((-5, -5, -5), (5, 5, 5))
    info = StageInfo(points=points, layout={1: (20, 0, 0)}, periodic=box)
    with UsdWriter(tmp_path / "out.usda", info) as out:
        out.write(0, position[0], velocity[0])
    stage = checked(tmp_path / "out.usda")
    cache = UsdGeom.XformCache(0)
    for w in (0, 1):
        prim = stage.GetPrimAtPath(f"/World/env_000{w}/water")
        np.testing.assert_array_equal(
            UsdGeom.Points(prim).GetPointsAttr().Get(0), position[0, 6 * w : 6 * w + 6]
        )
        moved = cache.GetLocalToWorldTransform(prim).ExtractTranslation()
        np.testing.assert_array_equal(moved, (20 * w, 0, 0))
        assert stage.GetPrimAtPath(f"/World/env_000{w}/periodic_box")
    # The camera sees both.
    frustum = UsdGeom.Camera(stage.GetPrimAtPath("/World/camera")).GetCamera(0).frustum
    for corner in np.ndindex(2, 2, 2):
        assert frustum.Intersects(Gf.Vec3d(*np.where(corner, (25, 5, 5), (-5, -5, -5)).tolist()))
