"""Recordings are read back through their root, as a renderer would."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade

from particlesim.output.usd.description import LinksPrim, Shape, StageInfo
from particlesim.output.usd.writing.writer import UsdWriter

from .recordings import (
    COUNT,
    RED,
    complaints,
    folder_content,
    group,
    motion,
    opened,
    points_at,
    record,
)


def test_points_and_velocities_at_every_time_code_are_those_given(tmp_path):
    # 30 frames a second: clips are read right also where the rate is not USD's default of 24.
    path = tmp_path / "out.usda"
    position, velocity = record(path, StageInfo(points=[group()], frames=5, fps=30), frames=5)
    stage = opened(path)
    for frame in range(5):
        np.testing.assert_array_equal(
            points_at(stage, "/World/env_0000/water", frame), position[frame]
        )
        velocities = stage.GetAttributeAtPath("/World/env_0000/water.velocities").Get(frame)
        np.testing.assert_array_equal(velocities, velocity[frame])
    for name in ("points", "velocities", "extent"):
        attribute = stage.GetAttributeAtPath(f"/World/env_0000/water.{name}")
        assert attribute.GetTimeSamples() == [0, 1, 2, 3, 4]
        # A default in the root would hide the clips.
        assert stage.GetRootLayer().GetAttributeAtPath(attribute.GetPath()).default is None


@pytest.mark.parametrize("suffix", [".usda", ".usd", ".usdc"])
def test_root_in_every_format_and_relative_to_its_folder(tmp_path, suffix):
    made, moved = tmp_path / "a", tmp_path / "b#1"
    made.mkdir()
    position, _ = record(made / f"dam break.v2{suffix}", StageInfo(points=[group()], frames=3))
    made.rename(moved)
    stage = opened(moved / f"dam break.v2{suffix}")
    np.testing.assert_array_equal(points_at(stage, "/World/env_0000/water", 2), position[2])
    names = {"manifest.usda", *(f"f.{frame:06d}.usdc" for frame in range(3))}
    assert folder_content(moved) == {f"dam break.v2{suffix}"} | {
        f"dam break.v2.clips/{name}" for name in names
    }


def test_metadata(tmp_path):
    path = tmp_path / "out.usda"
    info = StageInfo(points=[group()], frames=3, fps=25, up_axis="z", meters_per_unit=0.01)
    record(path, info)
    stage = opened(path)
    assert stage.GetDefaultPrim().GetPath() == "/World"
    assert UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z
    assert UsdGeom.GetStageMetersPerUnit(stage) == 0.01
    assert stage.GetTimeCodesPerSecond() == stage.GetFramesPerSecond() == 25
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0, 2)


def test_validators_are_awake(tmp_path):
    path = tmp_path / "out.usda"
    record(path, StageInfo(points=[group()], frames=3))
    stage = Usd.Stage.Open(str(path))
    stage.GetRootLayer().ClearDefaultPrim()
    assert any("default" in complaint.lower() for complaint in complaints(stage))


def test_velocity_of_playback_lands_on_the_next_frame(tmp_path):
    # A hundredth of a second a frame at 24 frames a second: slow motion.
    path, dt = tmp_path / "out.usda", 0.01
    info = StageInfo(points=[group()], frames=2, fps=24, frame_time=dt)
    position, velocity = motion(1)
    with UsdWriter(path, info) as recorder:
        recorder.write(0, position[0], velocity[0])
        recorder.write(1, position[0] + dt * velocity[0], velocity[0])
    stage = opened(path)
    cloud = UsdGeom.Points(stage.GetPrimAtPath("/World/env_0000/water"))
    now, ahead = (np.array(cloud.GetPointsAttr().Get(frame)) for frame in (0, 1))
    moved = now + np.array(cloud.GetVelocitiesAttr().Get(0)) / 24
    # Three roundings of numbers below 4, each at most 2^-23.
    np.testing.assert_allclose(moved, ahead, atol=3 * 2**-22)


def test_ids_pid_widths_and_color(tmp_path):
    path = tmp_path / "out.usda"
    ids, widths = np.arange(COUNT) * 7, np.linspace(0.1, 0.3, COUNT)
    record(path, StageInfo(points=[group(ids=ids, widths=widths, color=RED)], frames=3))
    stage = opened(path)
    prim = stage.GetPrimAtPath("/World/env_0000/water")
    cloud = UsdGeom.Points(prim)
    pid = UsdGeom.PrimvarsAPI(prim).GetPrimvar("pid")
    np.testing.assert_array_equal(cloud.GetIdsAttr().Get(), ids)
    np.testing.assert_array_equal(pid.Get(), ids)
    assert pid.GetTypeName() == Sdf.ValueTypeNames.IntArray
    np.testing.assert_array_equal(cloud.GetWidthsAttr().Get(), widths.astype(np.float32))
    assert cloud.GetWidthsInterpolation() == "vertex"
    np.testing.assert_allclose(cloud.GetDisplayColorAttr().Get(), [RED], rtol=1e-6)
    material = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]
    shader = material.ComputeSurfaceSource()[0]
    np.testing.assert_allclose(shader.GetInput("diffuseColor").Get(), RED, rtol=1e-6)


def test_one_width_for_all_is_one_number(tmp_path):
    path = tmp_path / "out.usda"
    record(path, StageInfo(points=[group(widths=0.25)], frames=3))
    stage = opened(path)
    cloud = UsdGeom.Points(stage.GetPrimAtPath("/World/env_0000/water"))
    assert list(cloud.GetWidthsAttr().Get()) == [0.25]
    assert cloud.GetWidthsInterpolation() == "constant"


def test_particles_without_a_size_can_be_seen(tmp_path):
    path = tmp_path / "out.usda"
    position, _ = record(path, StageInfo(points=[group(widths=None)], frames=3))
    stage = opened(path)
    cloud = UsdGeom.Points(stage.GetPrimAtPath("/World/env_0000/water"))
    diagonal = np.linalg.norm(np.ptp(position[0], axis=0))
    np.testing.assert_allclose(cloud.GetWidthsAttr().Get(), [0.01 * diagonal], rtol=1e-5)


def test_extent_holds_the_spheres_and_not_only_their_centers(tmp_path):
    path = tmp_path / "out.usda"
    widths = np.zeros(COUNT)
    widths[3] = 100.0  # much larger than the motion: alone it makes the extent
    position, _ = record(path, StageInfo(points=[group(widths=widths)], frames=3))
    stage = opened(path)
    cloud = UsdGeom.Points(stage.GetPrimAtPath("/World/env_0000/water"))
    for frame in range(3):
        expected = position[frame, 3] + np.array([[-50.0], [50.0]], dtype=np.float32)
        np.testing.assert_array_equal(cloud.GetExtentAttr().Get(frame), expected)


def test_worlds_have_rooms_of_their_own(tmp_path):
    path = tmp_path / "out.usda"
    points = [group(0, 0, 5), group(1, 5, 7), group(1, 5, 7, name="wa/ter"), group(1, 5, 7)]
    position, _ = record(path, StageInfo(points=points, frames=3))
    stage = opened(path)
    clouds = [str(p.GetPath()) for p in stage.Traverse() if p.IsA(UsdGeom.Points)]
    # A name that is not valid, and one that is taken, are made so.
    assert sorted(clouds) == [
        "/World/env_0000/water",
        "/World/env_0001/wa_ter",
        "/World/env_0001/water",
        "/World/env_0001/water_2",
    ]
    for frame in range(3):
        first, second = (points_at(stage, f"/World/env_000{w}/water", frame) for w in (0, 1))
        np.testing.assert_array_equal(first, position[frame, :5])
        np.testing.assert_array_equal(second, position[frame, 5:])


def test_rows_may_be_in_any_order(tmp_path):
    path = tmp_path / "out.usda"
    rows = np.random.default_rng(0).permutation(COUNT)[:8]
    position, _ = record(path, StageInfo(points=[group(indices=rows, ids=rows)], frames=3))
    found = points_at(opened(path), "/World/env_0000/water", 1)
    np.testing.assert_array_equal(found, position[1, rows])


def test_links_follow_their_particles(tmp_path):
    path = tmp_path / "out.usda"
    pairs = np.array([[0, 1], [1, 2], [7, 3]])
    links = [LinksPrim(0, "rope", pairs, 0.05, RED)]
    position, _ = record(path, StageInfo(points=[group()], links=links, frames=3))
    stage = opened(path)
    curves = UsdGeom.BasisCurves(stage.GetPrimAtPath("/World/env_0000/rope"))
    assert curves.GetTypeAttr().Get() == UsdGeom.Tokens.linear
    assert list(curves.GetCurveVertexCountsAttr().Get()) == [2, 2, 2]
    for frame in range(3):
        ends = points_at(stage, "/World/env_0000/rope", frame).reshape(-1, 2, 3)
        np.testing.assert_array_equal(ends, position[frame][pairs])


def test_links_take_the_short_way_in_a_periodic_box(tmp_path):
    path = tmp_path / "out.usda"
    position = np.array([[0.1, 0.1, 0.5], [0.9, 0.9, 0.5]])
    info = StageInfo(
        points=[group(count=2)],
        links=[LinksPrim(0, "bond", np.array([[0, 1]]), 0.05, RED)],
        periodic=((0, None, 0), (1, None, 1)),
    )
    with UsdWriter(path, info) as recorder:
        recorder.write(0, position, np.zeros((2, 3)))
    stage = opened(path)
    ends = points_at(stage, "/World/env_0000/bond", 0)
    # Through the face on x; y is open, and has no other way.
    np.testing.assert_allclose(ends, [[0.1, 0.1, 0.5], [-0.1, 0.9, 0.5]], atol=1e-6)
    outline = points_at(stage, "/World/periodic_box", 0)
    np.testing.assert_array_equal(outline[:, [0, 2]].min(axis=0), [0, 0])
    np.testing.assert_array_equal(outline[:, [0, 2]].max(axis=0), [1, 1])


def test_shapes_are_where_they_should_be(tmp_path):
    path = tmp_path / "out.usda"
    shapes = [
        Shape("plane", ((0, -1, 0), (1, 2, 0))),
        Shape("box", ((-1, -2, -3), (3, 2, 1))),
        Shape("sphere", ((1, 2, 3), 0.5), container=False),
    ]
    record(path, StageInfo(points=[group()], shapes=shapes, frames=3))
    stage = opened(path)
    room = "/World/env_0000/boundaries"
    plane = points_at(stage, f"{room}/plane", 0)
    np.testing.assert_allclose((plane - [0, -1, 0]) @ [1, 2, 0], 0, atol=1e-5)
    assert np.dot(np.cross(plane[1] - plane[0], plane[2] - plane[1]), [1, 2, 0]) > 0
    for part in ("faces", "edges"):
        corners = points_at(stage, f"{room}/box/{part}", 0)
        np.testing.assert_array_equal(corners.min(axis=0), [-1, -2, -3])
        np.testing.assert_array_equal(corners.max(axis=0), [3, 2, 1])
    ball = points_at(stage, f"{room}/sphere", 0) - [1, 2, 3]
    np.testing.assert_allclose(np.linalg.norm(ball, axis=1), 0.5, rtol=1e-6)

    def opacity(name: str) -> float:
        binding = UsdShade.MaterialBindingAPI(stage.GetPrimAtPath(f"{room}/{name}"))
        return binding.ComputeBoundMaterial()[0].ComputeSurfaceSource()[0].GetInput("opacity").Get()

    # What particles are inside of must not hide them.
    assert opacity("box/faces") < 0.5
    assert opacity("sphere") == opacity("plane") == 1


@pytest.mark.parametrize("name", ["box/faces", "sphere"])
def test_surfaces_face_outwards(tmp_path, name):
    path = tmp_path / "out.usda"
    shapes = [Shape("box", ((1, 1, 1), (2, 3, 4))), Shape("sphere", ((1, 2, 3), 0.5))]
    record(path, StageInfo(points=[group()], shapes=shapes, frames=3))
    stage = opened(path)
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath(f"/World/env_0000/boundaries/{name}"))
    points = np.array(mesh.GetPointsAttr().Get(), dtype=float)
    quads = points[np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 4)]
    normals = np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1])
    out = quads.mean(axis=1) - 0.5 * (points.min(axis=0) + points.max(axis=0))
    assert np.all(np.sum(normals * out, axis=1) > 0)


@pytest.mark.parametrize("up_axis", ["y", "z"])
def test_camera_sees_everything_from_above(tmp_path, up_axis):
    path, up = tmp_path / "out.usda", "xyz".index(up_axis)
    floor = Shape("plane", ((0, 0, 0), np.eye(3)[up]))
    info = StageInfo(
        points=[group()], shapes=[floor, Shape("box", ((2, 2, 2), (9, 3, 4)))], up_axis=up_axis
    )
    position, _ = record(path, info, frames=1)
    stage = opened(path)
    frustum = UsdGeom.Camera(stage.GetPrimAtPath("/World/camera")).GetCamera(0).frustum
    for point in [*position[0], (2, 2, 2), (9, 3, 4), (9, 2, 4), (2, 3, 2)]:
        assert frustum.Intersects(Gf.Vec3d(*map(float, point)))
    assert frustum.position[up] > position[0, :, up].max()
    assert frustum.ComputeUpVector()[up] > 0.5
    lights = [p.GetTypeName() for p in stage.Traverse() if "Light" in p.GetTypeName()]
    assert sorted(lights) == ["DistantLight", "DomeLight"]


def test_fields_are_primvars(tmp_path):
    path = tmp_path / "out.usda"
    rng = np.random.default_rng(2)
    density, field = rng.random((2, COUNT)), rng.random((2, COUNT, 3))
    position, velocity = motion(2)
    fields = {"density": 1, "magnetic field": 3}
    with UsdWriter(path, StageInfo(points=[group()], frames=2), fields=fields) as recorder:
        for frame in range(2):
            values = {"density": density[frame], "magnetic field": field[frame]}
            recorder.write(frame, position[frame], velocity[frame], values)
    stage = opened(path)
    primvars = UsdGeom.PrimvarsAPI(stage.GetPrimAtPath("/World/env_0000/water"))
    scalar, vector = primvars.GetPrimvar("density"), primvars.GetPrimvar("magnetic_field")
    assert scalar.GetTypeName() == Sdf.ValueTypeNames.FloatArray
    assert vector.GetTypeName() == Sdf.ValueTypeNames.Float3Array
    for frame in range(2):
        np.testing.assert_array_equal(scalar.Get(frame), density[frame].astype(np.float32))
        np.testing.assert_array_equal(vector.Get(frame), field[frame].astype(np.float32))
