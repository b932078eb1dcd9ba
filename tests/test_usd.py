"""Recordings are read back through their root, as a renderer would."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import warp as wp
from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdShade, UsdValidation, Vt

from particlesim.output.usd.description import LinksPrim, PointsPrim, Shape, StageInfo
from particlesim.output.usd.writing.writer import UsdWriter

BLUE, RED = (0.2, 0.5, 0.9), (0.9, 0.2, 0.1)
# Blender drops, without a word, every primvar after one of another type.
BLENDER_PRIMVARS = {"float[]", "int[]", "float3[]", "color3f[]"}
COUNT = 12


def group(world: int = 0, start: int = 0, count: int = COUNT, **changed) -> PointsPrim:
    arguments = {
        "world": world,
        "name": "water",
        "indices": slice(start, start + count),
        "ids": np.arange(count),
        "widths": 0.1,
        "color": BLUE,
    }
    return PointsPrim(**(arguments | changed))


def motion(frames: int, count: int = COUNT) -> tuple[np.ndarray, np.ndarray]:
    """Random positions and velocities, (frames, count, 3), in single precision."""
    rng = np.random.default_rng(1)
    position = rng.normal(size=(frames, count, 3)).astype(np.float32)
    return position, rng.normal(size=(frames, count, 3)).astype(np.float32)


def record(path: Path, info: StageInfo, frames: int = 3, count: int = COUNT, **options):
    """A recording of ``motion`` and how it was made."""
    position, velocity = motion(frames, count)
    with UsdWriter(path, info, **options) as recorder:
        for frame in range(frames):
            recorder.write(frame, position[frame], velocity[frame])
    return position, velocity


def complaints(stage: Usd.Stage) -> list[str]:
    """What the validators of the wheel report, all of them."""
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    errors = UsdValidation.ValidationContext(validators).Validate(stage)
    return [f"{error.GetName()}: {error.GetMessage()}" for error in errors]


def opened(path: Path) -> Usd.Stage:
    """The stage, after the validators and the checks that they lack, at every frame.

    The caller has to hold it: its prims are gone with it.
    """
    stage = Usd.Stage.Open(str(path))
    assert complaints(stage) == []
    for prim in stage.Traverse():
        kinds = {str(a.GetTypeName()) for a in prim.GetAttributes() if "primvars:" in a.GetName()}
        assert kinds <= BLENDER_PRIMVARS
        if prim.IsA(UsdGeom.PointBased):
            check_gprim(prim, path.with_suffix(".clips"))
    return stage


def check_gprim(prim: Usd.Prim, clips: Path) -> None:
    """Arrays of one length and the right extent, at every frame that was written."""
    based = UsdGeom.PointBased(prim)
    numbers = [int(file.stem[2:]) for file in clips.glob("f.*.usdc")]
    for frame in numbers:
        points = based.GetPointsAttr().Get(frame)
        expected = UsdGeom.Boundable.ComputeExtentFromPlugins(based, frame)
        if prim.IsA(UsdGeom.Points):
            cloud = UsdGeom.Points(prim)
            lengths = {len(cloud.GetIdsAttr().Get()), len(cloud.GetVelocitiesAttr().Get(frame))}
            assert lengths == {len(points)}
            # USD itself computes none from one width for all.
            widths = np.resize(cloud.GetWidthsAttr().Get(), len(points)).astype(np.float32)
            expected = UsdGeom.Points.ComputeExtent(points, Vt.FloatArray.FromNumpy(widths))
        elif prim.IsA(UsdGeom.BasisCurves):
            assert sum(UsdGeom.Curves(prim).GetCurveVertexCountsAttr().Get()) == len(points)
        # Both are one rounded addition.
        extent = np.array(based.GetExtentAttr().Get(frame))
        np.testing.assert_allclose(extent, np.array(expected), rtol=1e-6, atol=1e-7)
        for primvar in UsdGeom.PrimvarsAPI(prim).GetAuthoredPrimvars():
            single = primvar.GetInterpolation() == UsdGeom.Tokens.constant
            assert len(primvar.Get(frame)) == (1 if single else len(points))


def points_at(stage: Usd.Stage, path: str, frame: float) -> np.ndarray:
    return np.array(stage.GetAttributeAtPath(f"{path}.points").Get(frame))


def folder_content(path: Path) -> set[str]:
    return {str(file.relative_to(path)) for file in path.rglob("*") if file.is_file()}


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
        Shape.plane((0, -1, 0), (1, 2, 0)),
        Shape.box((-1, -2, -3), (3, 2, 1)),
        Shape.sphere((1, 2, 3), 0.5, container=False),
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
    shapes = [Shape.box((1, 1, 1), (2, 3, 4)), Shape.sphere((1, 2, 3), 0.5)]
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
    floor = Shape.plane((0, 0, 0), np.eye(3)[up])
    info = StageInfo(
        points=[group()], shapes=[floor, Shape.box((2, 2, 2), (9, 3, 4))], up_axis=up_axis
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


def test_warp_arrays_are_taken(tmp_path):
    path = tmp_path / "out.usda"
    position, velocity = motion(1)
    with UsdWriter(path, StageInfo(points=[group()])) as recorder:
        arrays = (wp.array(a[0], dtype=wp.vec3, device="cpu") for a in (position, velocity))
        recorder.write(0, *arrays)
    np.testing.assert_array_equal(points_at(opened(path), "/World/env_0000/water", 0), position[0])


def test_existing_output_is_refused_and_kept(tmp_path):
    path, info = tmp_path / "out.usda", StageInfo(points=[group()], frames=5)
    position, _ = record(path, info, frames=5)
    with pytest.raises(
        FileExistsError, match=r"^UsdRecorder: path must be a new file, .*overwrite=True\.$"
    ):
        UsdWriter(path, info)
    with pytest.raises(FileExistsError, match="share its frames"):
        UsdWriter(tmp_path / "out.usdc", info, overwrite=True)
    # Nothing is lost either while a new recording has no frame yet.
    UsdWriter(path, info, overwrite=True).close()
    np.testing.assert_array_equal(points_at(opened(path), "/World/env_0000/water", 4), position[4])


def test_overwriting_leaves_no_stale_frame(tmp_path):
    path, info = tmp_path / "out.usda", StageInfo(points=[group()], frames=5)
    record(path, info, frames=5)
    (tmp_path / "out.clips" / "notes.txt").write_text("not ours")
    (tmp_path / "out.clips" / "f.000005.tmp.usdc").write_text("half a frame")
    record(path, info, frames=2, overwrite=True)
    assert opened(path).GetEndTimeCode() == 1
    assert folder_content(tmp_path / "out.clips") == {
        "f.000000.usdc",
        "f.000001.usdc",
        "manifest.usda",
        "notes.txt",
    }


def test_unusable_paths_are_refused(tmp_path):
    info = StageInfo(points=[group()])
    with pytest.raises(
        FileNotFoundError, match=r"^UsdRecorder: path must be in an existing folder"
    ):
        UsdWriter(tmp_path / "missing" / "out.usda", info)
    with pytest.raises(ValueError, match=r"^UsdRecorder: path must end in \.usda, \.usd, \.usdc"):
        UsdWriter(tmp_path / "out.abc", info)


def test_interrupted_recording_can_be_read(tmp_path):
    path = tmp_path / "out.usda"
    position, velocity = motion(3)
    recorder = UsdWriter(path, StageInfo(points=[group()], frames=10))
    for frame in range(3):
        recorder.write(frame, position[frame], velocity[frame])
        # The planned end reaches past the files, which are there as soon as write returns.
        stage = opened(path)
        assert stage.GetEndTimeCode() == 9
        for written in range(frame + 1):
            found = points_at(stage, "/World/env_0000/water", written)
            np.testing.assert_array_equal(found, position[written])
        del stage  # or the next one would be this one, from USD's cache


def test_an_exception_leaves_the_frames_so_far(tmp_path):
    path = tmp_path / "out.usda"
    position, velocity = motion(2)
    with (
        pytest.raises(KeyboardInterrupt),
        UsdWriter(path, StageInfo(points=[group()], frames=10)) as recorder,
    ):
        recorder.write(0, position[0], velocity[0])
        recorder.write(1, position[1], velocity[1])
        raise KeyboardInterrupt
    assert opened(path).GetEndTimeCode() == 1


@pytest.mark.skipif(os.name == "nt", reason="there is no kill -9 on Windows")
def test_killed_recording_can_be_read(tmp_path):
    script = """
import sys
import numpy as np
from particlesim.output.usd.writing.writer import UsdWriter
from particlesim.output.usd.description import PointsPrim, StageInfo

count = 50_000
drops = PointsPrim(0, "drops", slice(0, count), np.arange(count), 0.1, (1, 1, 1))
recorder = UsdWriter(sys.argv[1], StageInfo(points=[drops], frames=10_000))
for frame in range(10_000):
    recorder.write(frame, np.full((count, 3), frame), np.zeros((count, 3)))
"""
    path, clips = tmp_path / "out.usda", tmp_path / "out.clips"
    root = Path(__file__).parents[1]
    process = subprocess.Popen([sys.executable, "-c", script, str(path)], cwd=root)
    deadline = time.monotonic() + 60
    while not (clips / "f.000005.usdc").exists():
        assert process.poll() is None, "the recording ended by itself"
        assert time.monotonic() < deadline
        time.sleep(0.001)
    process.send_signal(signal.SIGKILL)
    process.wait()
    frames = sorted(int(f.name.split(".")[1]) for f in clips.glob("f.??????.usdc"))
    assert frames == list(range(len(frames)))
    stage = Usd.Stage.Open(str(path))
    assert complaints(stage) == []
    for frame in frames:
        np.testing.assert_array_equal(points_at(stage, "/World/env_0000/drops", frame), frame)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e39])  # 1e39: not in single precision
@pytest.mark.parametrize("name", ["position", "velocity", "density"])
def test_values_that_are_not_finite_are_refused(tmp_path, name, bad):
    path = tmp_path / "out.usda"
    position, velocity = (array.astype(float) for array in motion(2))
    arrays = [{"position": p, "velocity": v, "density": p[:, 0].copy()}
              for p, v in zip(position, velocity, strict=True)]  # fmt: skip
    points = [group(0, 0, 5), group(1, 5, 7, ids=np.arange(10, 17))]
    info = StageInfo(points=points, frames=10)
    with UsdWriter(path, info, fields={"density": 1}) as recorder:

        def write(frame: int) -> None:
            given = arrays[frame]
            recorder.write(
                frame, given["position"], given["velocity"], {"density": given["density"]}
            )

        write(0)
        before, good = folder_content(tmp_path), arrays[1][name].copy()
        arrays[1][name][7:9] = bad
        message = (
            rf"^UsdRecorder.write: {name} of particle 7 \(/World/env_0001/water, id 12\) "
            r"at frame 1 must be finite in single precision, got .*; look for .*\.$"
        )
        with pytest.raises(ValueError, match=message):
            write(1)
        assert folder_content(tmp_path) == before
        arrays[1][name][:] = good  # mended, it goes on
        write(1)
    assert opened(path).GetEndTimeCode() == 1


def test_nothing_is_created_by_a_first_frame_that_is_refused(tmp_path):
    with (
        pytest.raises(ValueError, match=r"position of particle 0 .* at frame 0"),
        UsdWriter(tmp_path / "out.usda", StageInfo(points=[group()])) as recorder,
    ):
        recorder.write(0, np.full((COUNT, 3), np.nan), np.zeros((COUNT, 3)))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            (0, np.zeros((COUNT - 1, 3)), np.zeros((COUNT, 3))),
            r"position must have shape \(12, 3\)",
        ),
        ((0, np.zeros((COUNT, 3)), np.zeros(COUNT)), r"velocity must have shape \(12, 3\)"),
        ((0, np.zeros((COUNT, 3)), np.zeros((COUNT, 3)), {"rho": np.zeros(3)}), "fields must be"),
        ((0.5, np.zeros((COUNT, 3)), np.zeros((COUNT, 3))), "frame must be a whole number"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(tmp_path, arguments, message):
    recorder = UsdWriter(tmp_path / "out.usda", StageInfo(points=[group()]))
    with pytest.raises(ValueError, match=message):
        recorder.write(*arguments)


def test_frames_come_one_by_one(tmp_path):
    position, velocity = motion(1)
    frame = (position[0], velocity[0])
    with UsdWriter(tmp_path / "out.usda", StageInfo(points=[group()], frames=9)) as recorder:
        recorder.write(4, *frame)
        for number in (3, 4, 6):
            with pytest.raises(ValueError, match=f"frame must be 5, the next, got {number}"):
                recorder.write(number, *frame)
        recorder.write(5, *frame)
    with pytest.raises(ValueError, match="before close"):
        recorder.write(6, *frame)
    stage = opened(tmp_path / "out.usda")
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (4, 5)


def test_more_frames_than_planned(tmp_path):
    path = tmp_path / "out.usda"
    position, velocity = motion(8)
    recorder = UsdWriter(path, StageInfo(points=[group()], frames=2))
    for frame in range(8):
        recorder.write(frame, position[frame], velocity[frame])
    # Readable already before the end is known.
    found = points_at(opened(path), "/World/env_0000/water", 7)
    np.testing.assert_array_equal(found, position[7])
    recorder.close()
    recorder.close()
    assert Sdf.Layer.OpenAsAnonymous(str(path)).endTimeCode == 7


def test_memory_does_not_grow_with_frames(tmp_path):
    position, velocity = motion(1)
    with UsdWriter(tmp_path / "out.usda", StageInfo(points=[group()], frames=50)) as recorder:
        recorder.write(0, position[0], velocity[0])
        layers = len(Sdf.Layer.GetLoadedLayers())
        for frame in range(1, 50):
            recorder.write(frame, position[0], velocity[0])
        assert len(Sdf.Layer.GetLoadedLayers()) == layers
        assert recorder._clip.ListAllTimeSamples() == [49]


@pytest.mark.parametrize(
    ("owner", "name", "error"),
    [
        (os, "replace", OSError(28, "No space left on device")),
        (Sdf.Layer, "Export", Tf.ErrorException()),
    ],
)
def test_a_write_that_fails_loses_no_frame(tmp_path, monkeypatch, owner, name, error):
    path = tmp_path / "out.usda"
    position, velocity = motion(2)

    def fail(*_):
        raise error

    with UsdWriter(path, StageInfo(points=[group()], frames=2)) as recorder:
        recorder.write(0, position[0], velocity[0])
        before = folder_content(tmp_path)
        monkeypatch.setattr(owner, name, fail)
        with pytest.raises(OSError, match=r"^UsdRecorder: .*f\.000001\.usdc' must be writable"):
            recorder.write(1, position[1], velocity[1])
        assert folder_content(tmp_path) == before
        monkeypatch.undo()
        recorder.write(1, position[1], velocity[1])
    np.testing.assert_array_equal(points_at(opened(path), "/World/env_0000/water", 1), position[1])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: group(world=-1), "PointsPrim: world must be a whole number"),
        (lambda: group(name=""), "PointsPrim: name must be a word"),
        (lambda: group(indices=slice(3, 3)), "PointsPrim: indices must have both ends and a row"),
        (lambda: group(indices=np.array([0.5])), "PointsPrim: indices must be at least one row"),
        (lambda: group(indices=np.array([-1])), "PointsPrim: indices must be at least 0"),
        (lambda: group(ids=np.arange(3)), "PointsPrim: ids must be 12 whole numbers"),
        (lambda: group(ids=np.arange(COUNT) + 2**31), r"PointsPrim: ids must be in 0\.\.2\^31"),
        (lambda: group(widths=-1.0), r"PointsPrim: widths must be at least 0 \[length\]"),
        (lambda: group(widths=np.full(COUNT, -1.0)), r"PointsPrim: widths must be at least 0"),
        (lambda: group(color=(0, 0, 2)), r"PointsPrim: color must be in 0\.\.1"),
        (lambda: LinksPrim(0, "rope", np.arange(3), 0.1, RED), "LinksPrim: pairs must have shape"),
        (
            lambda: LinksPrim(0, "rope", np.eye(2, dtype=int), 0, RED),
            "LinksPrim: width must be above",
        ),
        (lambda: Shape.plane((0, 0, 0), (0, 0, 0)), "Shape: normal must have a length"),
        (lambda: Shape.box((0, 0, 0), (1, 0, 1)), "Shape: upper must be above lower"),
        (lambda: Shape.sphere((0, 0, 0), 0), "Shape: radius must be above 0"),
        (lambda: Shape(0, "x", "torus", (0, 0)), "Shape: kind must be one of plane, box, sphere"),
        (lambda: StageInfo(points=[]), "StageInfo: points must hold a group"),
        (lambda: StageInfo(points=[group()], up_axis="x"), "StageInfo: up_axis must be 'y' or 'z'"),
        (lambda: StageInfo(points=[group()], fps=0), "StageInfo: fps must be above 0"),
        (lambda: StageInfo(points=[group()], frames=0), "StageInfo: frames must be a whole number"),
        (
            lambda: StageInfo(points=[group()], periodic=((0, 0, 0), (1, 1, 0))),
            "StageInfo: periodic must have upper above lower",
        ),
    ],
)
def test_descriptions_that_make_no_sense_are_refused(make, message):
    with pytest.raises(ValueError, match=f"^{message}.*, got .*; .*\\.$"):
        make()


@pytest.mark.parametrize(
    "fields", [{"a": 2}, {"pid": 1}, {"velocity": 3}, {"b c": 1, "b_c": 1}], ids=str
)
def test_fields_that_readers_would_mistake_are_refused(tmp_path, fields):
    with pytest.raises(ValueError, match=r"^UsdRecorder: fields.* must have .*, got .*; .*\.$"):
        UsdWriter(tmp_path / "out.usda", StageInfo(points=[group()]), fields=fields)
