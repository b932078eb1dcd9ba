"""The tools for USD files: every fault that is planted in a good recording is found."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, Vt

import particlesim as ps
from particlesim import cli
from particlesim.commands.scene_files import load_scene, ready_scenes
from particlesim.output.usd.checking.check import check
from particlesim.output.usd.checking.fault import Fault
from particlesim.output.usd.info import info
from particlesim.output.usd.pack import pack

FRAMES, COUNT = 5, 12  # the start state is one frame more
PLANT = 3  # the frame in which faults are planted
SMALL = {
    "dam_break": {"spacing": 0.1},
    "star_collision": {"count": 50},
    "freezing": {"cells": 4},
    "gas_in_a_box": {"count": 50},
}
Types = Sdf.ValueTypeNames


def build(offset: float) -> ps.Scene:
    """A rope of beads in a box."""
    scene = ps.Scene()
    points = np.random.default_rng(0).uniform((0, 0.2, 0), (1, 1.2, 1), (COUNT, 3))
    points[:, 1] += offset
    beads = scene.add_particles(
        points, velocity=(1, 0, 0), radius=np.linspace(0.02, 0.05, COUNT), group="beads"
    )
    pairs = np.stack([beads.indices[:-1], beads.indices[1:]], axis=1)
    scene.add_interaction(ps.Springs(pairs, stiffness=10.0))
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    scene.add_constraint(ps.BoxBoundary((-5, 0, -5), (5, 5, 5)))
    return scene


@pytest.fixture(scope="module")
def good(tmp_path_factory) -> Path:
    """A folder with a recording of two worlds, and the same packed into one file."""
    folder = tmp_path_factory.mktemp("good")
    sim = ps.Simulation([build(0.0), build(1.0)], ps.Settings(dt=1 / 30), device="cpu")
    sim.run(FRAMES, record=folder / "out.usda", fields=("force", "mass"))
    pack(folder / "out.usda", folder / "packed.usdc")
    return folder


@pytest.fixture
def copy(good, tmp_path) -> Path:
    return shutil.copytree(good, tmp_path / "copy")


BEADS = Sdf.Path("/World/env_0001/beads")


class Planted:
    """A recording to be spoilt: ``samples`` is the layer that holds the values of ``PLANT``."""

    def __init__(self, path: Path):
        self.path = path
        clips = path.with_suffix(".clips")
        self.clip = clips / f"f.{PLANT:06d}.usdc" if path.suffix == ".usda" else path
        self.root = Sdf.Layer.FindOrOpen(str(path))
        self.samples = Sdf.Layer.FindOrOpen(str(self.clip))

    def value(self, name: str) -> np.ndarray:
        return np.array(self.samples.QueryTimeSample(BEADS.AppendProperty(name), PLANT))

    def set(self, name: str, value, frame: float = PLANT) -> None:
        self.samples.SetTimeSample(BEADS.AppendProperty(name), frame, value)

    def erase(self, name: str) -> None:
        self.samples.EraseTimeSample(BEADS.AppendProperty(name), PLANT)


def vectors(array: np.ndarray) -> Vt.Vec3fArray:
    return Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(array, dtype=np.float32))


def length(file: Planted) -> None:
    file.set("velocities", vectors(file.value("velocities")[1:]))


def primvar_length(file: Planted) -> None:
    file.set("primvars:mass", Vt.FloatArray([1.0] * (COUNT + 1)))


def no_extent(file: Planted) -> None:
    file.erase("extent")


def wrong_extent(file: Planted) -> None:
    # A millionth is more than rounding may make of it: numbers are of order one.
    file.set("extent", vectors(file.value("extent") + 1e-5))


def not_a_number(file: Planted) -> None:
    points = file.value("points")
    points[7, 1] = np.nan
    file.set("points", vectors(points))


def half(file: Planted) -> None:
    path = BEADS.AppendProperty("velocities")
    frames = file.samples.ListTimeSamplesForPath(path)
    spec = file.samples.GetPrimAtPath(BEADS)
    del spec.properties["velocities"]
    Sdf.AttributeSpec(spec, "velocities", Types.Half3Array)
    for frame in frames:
        file.set("velocities", Vt.Vec3hArray([Gf.Vec3h(1)] * COUNT), frame)


def other_times(file: Planted) -> None:
    velocities = vectors(file.value("velocities"))
    file.erase("velocities")
    file.set("velocities", velocities, PLANT + 0.5)


def no_default_prim(file: Planted) -> None:
    file.root.ClearDefaultPrim()


def nested(file: Planted) -> None:
    ball = Sdf.CreatePrimInLayer(file.root, BEADS.AppendChild("ball"))
    ball.specifier, ball.typeName = Sdf.SpecifierDef, "Sphere"


def long_integers(file: Planted) -> None:
    spec = Sdf.AttributeSpec(file.root.GetPrimAtPath(BEADS), "primvars:name", Types.Int64Array)
    spec.default = Vt.Int64Array(range(COUNT))
    spec.SetInfo("interpolation", "vertex")


def wrong_fps(file: Planted) -> None:
    file.root.timeCodesPerSecond = file.root.framesPerSecond = 24


def wrong_time_codes(file: Planted) -> None:
    file.root.timeCodesPerSecond = 24


# fault planted: kind, prim, attribute, frame
VALUES = {
    length: ("length", BEADS, "velocities", PLANT),
    primvar_length: ("length", BEADS, "primvars:mass", PLANT),
    wrong_extent: ("wrong extent", BEADS, "extent", PLANT),
    not_a_number: ("not finite", BEADS, "points", PLANT),
    other_times: ("times", BEADS, "velocities", PLANT),
    no_default_prim: ("MissingDefaultPrim", "/", "", None),
    nested: ("InvalidNestedGprims", f"{BEADS}/ball", "", None),
    long_integers: ("primvar type", BEADS, "primvars:name", None),
    wrong_fps: ("fps", "/", "timeCodesPerSecond", None),
    wrong_time_codes: ("fps", "/", "timeCodesPerSecond", None),
}


def spoilt(path: Path, plant) -> list[Fault]:
    file = Planted(path)
    plant(file)
    for layer in {file.root, file.samples}:
        layer.Save()
    return check(path)


def is_one(faults: list[Fault], kind: str, prim, attribute: str, frame) -> None:
    """There is this fault, and nothing else is found where nothing was planted."""
    (fault,) = faults
    expected = (kind, str(prim), attribute, frame, ())
    assert (fault.kind, fault.prim, fault.attribute, fault.frame, fault.others) == expected
    line = str(fault)
    assert "\n" not in line and line.endswith(".")
    # House form: where, what must be, what is, what to do.
    assert line.startswith(str(prim)) and ": must " in line and ", got " in line and "; " in line
    assert frame is None or f"at frame {frame}" in line


def test_good_recordings_have_no_faults(good):
    assert check(good / "out.usda") == []
    assert check(good / "packed.usdc") == []


@pytest.mark.parametrize(
    "options", [{"every": 2}, {"instancer": True}, {"groups": ["beads"], "worlds": [1]}]
)
def test_recordings_of_other_kinds_have_no_faults(tmp_path, options):
    sim = ps.Simulation([build(0.0), build(1.0)], ps.Settings(dt=1 / 30), device="cpu")
    sim.run(FRAMES, record=tmp_path / "out.usda", **options)
    assert check(tmp_path / "out.usda") == []
    pack(tmp_path / "out.usda", tmp_path / "packed.usdc")
    assert check(tmp_path / "packed.usdc") == []


@pytest.mark.parametrize("name", ["out.usda", "packed.usdc"])
@pytest.mark.parametrize("plant", VALUES, ids=lambda plant: plant.__name__)
def test_planted_faults_are_found(copy, name, plant):
    is_one(spoilt(copy / name, plant), *VALUES[plant])


def test_half_precision(copy):
    is_one(spoilt(copy / "out.usda", half), "half", BEADS, "velocities", PLANT)
    # In one file usd-core sees the declaration too.
    fault, mismatch = spoilt(copy / "packed.usdc", half)
    assert (fault.kind, fault.frame, len(fault.others)) == ("half", 0, FRAMES)
    assert (mismatch.kind, mismatch.attribute) == ("AttributeTypeMismatch", "velocities")


def test_missing_extent(copy):
    is_one(spoilt(copy / "out.usda", no_extent), "missing extent", BEADS, "extent", PLANT)
    # There USD makes one up from those before and after.
    is_one(spoilt(copy / "packed.usdc", no_extent), "missing extent", BEADS, "extent", PLANT)


def test_no_extent_at_all(copy):
    def plant(file: Planted) -> None:
        for path in ["/World/env_0000/beads", "/World/env_0001/beads"]:
            del file.root.GetPrimAtPath(path).properties["extent"]

    faults = spoilt(copy / "packed.usdc", plant)
    assert [(fault.kind, fault.attribute, len(fault.others)) for fault in faults] == [
        ("missing extent", "extent", FRAMES)
    ] * 2
    assert "and 5 more up to 5" in str(faults[0])


def test_a_gap_in_the_clips(copy):
    (copy / "out.clips" / f"f.{PLANT:06d}.usdc").unlink()
    is_one(check(copy / "out.usda"), "gap", "/World", "clips", PLANT)


def test_an_unfinished_recording(copy):
    for frame in (FRAMES - 1, FRAMES):
        (copy / "out.clips" / f"f.{frame:06d}.usdc").unlink()
    (fault,) = check(copy / "out.usda")
    assert (fault.kind, fault.frame, fault.others) == ("unfinished", FRAMES - 1, (FRAMES,))
    assert info(copy / "out.usda").missing == 2
    # What is there can be packed, and is whole.
    assert pack(copy / "out.usda", copy / "part.usdc") == FRAMES - 1
    assert check(copy / "part.usdc") == []


# What is left of the file, from nothing to all but its last byte.
@pytest.mark.parametrize("part", [0.0, 0.1, 0.5, 0.999])
def test_a_truncated_clip(copy, part):
    clip = copy / "out.clips" / f"f.{PLANT:06d}.usdc"
    content = clip.read_bytes()
    clip.write_bytes(content[: int(part * len(content))])
    is_one(check(copy / "out.usda"), "unreadable", "/World", "clips", PLANT)
    with pytest.raises(ValueError, match=f"frame {PLANT} must be readable"):
        pack(copy / "out.usda", copy / "new.usdc")
    assert not list(copy.glob("*new*"))


def test_a_missing_manifest(copy):
    (copy / "out.clips" / "manifest.usda").unlink()
    faults = check(copy / "out.usda")
    assert faults[0].kind == "manifest"
    with pytest.raises(ValueError, match="manifest"):
        pack(copy / "out.usda", copy / "new.usdc")


def test_a_default_that_hides_the_clips(copy):
    def plant(file: Planted) -> None:
        spec = file.root.GetAttributeAtPath(BEADS.AppendProperty("points"))
        spec.default = Vt.Vec3fArray(COUNT)

    kinds = {(fault.kind, fault.attribute) for fault in spoilt(copy / "out.usda", plant)}
    assert ("hidden", "points") in kinds


def test_an_attribute_that_the_manifest_lacks(copy):
    def plant(file: Planted) -> None:
        spec = Sdf.AttributeSpec(file.samples.GetPrimAtPath(BEADS), "primvars:x", Types.FloatArray)
        file.set(spec.name, Vt.FloatArray(COUNT))

    faults = spoilt(copy / "out.usda", plant)
    is_one(faults, "undeclared", BEADS, "primvars:x", PLANT)


def test_a_range_that_leaves_frames_out(copy):
    def plant(file: Planted) -> None:
        file.root.endTimeCode = FRAMES - 2

    is_one(spoilt(copy / "out.usda", plant), "range", "/", "timeCodes", None)


# Prims that a recording may hold, made by hand


@pytest.fixture
def stage(tmp_path):
    """An empty stage as a good recording has it, of three frames."""
    stage = Usd.Stage.CreateNew(str(tmp_path / "made.usda"))
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/World").GetPrim())
    UsdGeom.SetStageUpAxis(stage, "Y")
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(24)
    stage.SetFramesPerSecond(24)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(2)
    return stage


def surface(stage) -> UsdGeom.Mesh:
    """A fan of 2, 3 and 4 triangles in the three frames."""
    mesh = UsdGeom.Mesh.Define(stage, "/World/surface")
    for frame in range(3):
        count = frame + 2
        angle = np.linspace(0, np.pi, count + 1)
        ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
        points = vectors(np.concatenate([[[0, 0, 0]], ring]))
        mesh.GetPointsAttr().Set(points, frame)
        mesh.GetNormalsAttr().Set(vectors(np.tile([0, 0, 1.0], (count + 2, 1))), frame)
        mesh.GetFaceVertexCountsAttr().Set([3] * count, frame)
        faces = [(0, k + 1, k + 2) for k in range(count)]
        mesh.GetFaceVertexIndicesAttr().Set(np.ravel(faces).tolist(), frame)
        mesh.GetExtentAttr().Set(UsdGeom.PointBased.ComputeExtent(points), frame)
    return mesh


def spheres(stage) -> UsdGeom.PointInstancer:
    """One, two and three instances in the three frames."""
    instancer = UsdGeom.PointInstancer.Define(stage, "/World/drops")
    ball = UsdGeom.Sphere.Define(stage, "/World/drops/ball")
    ball.GetRadiusAttr().Set(0.5)
    ball.GetExtentAttr().Set(vectors([[-0.5] * 3, [0.5] * 3]))
    instancer.GetPrototypesRel().SetTargets([ball.GetPath()])
    for frame in range(3):
        count = frame + 1
        instancer.GetPositionsAttr().Set(vectors(np.eye(3)[:count]), frame)
        instancer.GetProtoIndicesAttr().Set([0] * count, frame)
        instancer.GetExtentAttr().Set(instancer.ComputeExtentAtTime(frame, frame), frame)
    return instancer


def saved(stage) -> list[tuple]:
    stage.Save()
    found = check(stage.GetRootLayer().realPath)
    return [(fault.kind, fault.attribute, fault.frame) for fault in found]


def test_surfaces_and_instancers_that_change(stage):
    surface(stage)
    spheres(stage)
    assert saved(stage) == []


def test_faces_without_points(stage):
    surface(stage).GetFaceVertexIndicesAttr().Set([0, 1, 2, 0, 2, 9], 0)
    assert saved(stage) == [("index", "faceVertexIndices", 0)]


def test_more_faces_than_corners(stage):
    surface(stage).GetFaceVertexCountsAttr().Set([3, 3, 3], 0)
    assert saved(stage) == [("length", "faceVertexIndices", 0)]


def test_normals_of_another_frame(stage):
    surface(stage).GetNormalsAttr().Set(vectors(np.zeros((4, 3))), 2)
    assert saved(stage) == [("length", "normals", 2)]


def test_instances_of_nothing(stage):
    spheres(stage).GetProtoIndicesAttr().Set([0, 1], 1)
    assert ("index", "protoIndices", 1) in saved(stage)


def test_fewer_prototype_indices_than_instances(stage):
    spheres(stage).GetProtoIndicesAttr().Set([0], 2)
    assert ("length", "protoIndices", 2) in saved(stage)


def test_curves_that_do_not_add_up(stage):
    curves = UsdGeom.BasisCurves.Define(stage, "/World/rope")
    curves.GetTypeAttr().Set("linear")
    curves.GetPointsAttr().Set(vectors(np.eye(3)))
    curves.GetCurveVertexCountsAttr().Set([2, 2])
    curves.GetExtentAttr().Set(vectors([[0] * 3, [1] * 3]))
    assert saved(stage) == [("length", "points", None)]


def test_ids_that_are_not_different(stage):
    cloud = UsdGeom.Points.Define(stage, "/World/drops")
    cloud.GetPointsAttr().Set(vectors(np.eye(3)))
    cloud.GetIdsAttr().Set([4, 7, 4])
    cloud.GetExtentAttr().Set(vectors([[0] * 3, [1] * 3]))
    assert saved(stage) == [("ids", "ids", None)]


def test_a_transform_that_is_not_finite(stage):
    ball = UsdGeom.Sphere.Define(stage, "/World/ball")
    move = ball.AddTranslateOp()
    for frame in range(3):
        move.Set(Gf.Vec3d(0, np.inf if frame == 2 else 0, 0), frame)
    assert saved(stage) == [("not finite", "xformOp:translate", 2)]


def test_one_extent_for_all_frames_may_be_large(stage):
    cloud = UsdGeom.Points.Define(stage, "/World/drops")
    for frame in range(3):
        cloud.GetPointsAttr().Set(vectors(frame * np.eye(3)), frame)
    cloud.GetExtentAttr().Set(vectors([[-5] * 3, [5] * 3]))
    assert saved(stage) == []
    cloud.GetExtentAttr().Set(vectors([[-5] * 3, [1] * 3]))
    assert saved(stage) == [("wrong extent", "extent", 2)]


# Looking and packing


def test_info(good):
    found = info(good / "out.usda")
    assert found.frames == tuple(range(FRAMES + 1)) and found.missing == 0
    assert (found.fps, found.up_axis, found.default_prim) == (30, "Y", "/World")
    files = [good / "out.usda", *(good / "out.clips").iterdir()]
    assert found.files == len(files) and found.size == sum(f.stat().st_size for f in files)
    beads = next(prim for prim in found.prims if prim.type == "Points")
    assert (beads.path, beads.prims) == ("/World/env_####/beads", 2)
    assert (beads.count, beads.unit, beads.moving) == ((COUNT, COUNT), "points", True)
    assert {"force", "mass", "pid"} <= set(beads.primvars)
    assert "12 points" in str(found) and "6 frames, 0 to 5" in str(found)


def test_info_counts_what_changes(stage):
    surface(stage)
    spheres(stage)
    stage.Save()
    found = {prim.type: prim for prim in info(stage.GetRootLayer().realPath).prims}
    assert found["Mesh"].count == (2, 4) and found["PointInstancer"].count == (1, 3)


def test_packing_keeps_every_value(good):
    clips, packed = (Usd.Stage.Open(str(good / name)) for name in ("out.usda", "packed.usdc"))
    assert packed.GetRootLayer().GetExternalReferences() == ()
    paths = [prim.GetPath() for prim in clips.TraverseAll()]
    assert paths == [prim.GetPath() for prim in packed.TraverseAll()]
    compared = 0
    for path in paths:
        for attribute in clips.GetPrimAtPath(path).GetAttributes():
            other = packed.GetAttributeAtPath(attribute.GetPath())
            assert attribute.GetTimeSamples() == other.GetTimeSamples()
            for frame in [Usd.TimeCode.Default(), *range(FRAMES + 1)]:
                assert attribute.Get(frame) == other.Get(frame)
                compared += 1
    assert compared > 100
    for name in ("StartTimeCode", "EndTimeCode", "TimeCodesPerSecond", "FramesPerSecond"):
        assert getattr(clips, f"Get{name}")() == getattr(packed, f"Get{name}")()
    assert clips.GetPrimAtPath("/World").HasAuthoredMetadata("clips")
    assert not packed.GetPrimAtPath("/World").HasAuthoredMetadata("clips")


def test_packing_overwrites_when_asked_only(good, tmp_path, refused):
    out = tmp_path / "new.usdc"
    out.write_text("mine")
    with pytest.raises(FileExistsError, match=r"new\.usdc"):
        pack(good / "out.usda", out)
    assert out.read_text() == "mine"
    assert pack(good / "out.usda", out, overwrite=True) == FRAMES + 1
    assert [file.name for file in tmp_path.iterdir()] == ["new.usdc"]
    with refused("end in .usdc"):
        pack(good / "out.usda", tmp_path / "new.usda")
    with pytest.raises(FileNotFoundError, match="existing folder"):
        pack(good / "out.usda", tmp_path / "nowhere" / "new.usdc")


def test_packing_refuses_a_gap(copy):
    (copy / "out.clips" / f"f.{PLANT:06d}.usdc").unlink()
    with pytest.raises(ValueError, match=f"at frame {PLANT}: must have"):
        pack(copy / "out.usda", copy / "new.usdc")
    assert not list(copy.glob("*new*"))


def test_files_that_are_no_recordings(tmp_path, refused):
    (tmp_path / "notes.usda").write_text("no USD")
    np.savez(tmp_path / "frames.npz", x=np.zeros(3))
    for tool in (check, info):
        with pytest.raises(FileNotFoundError, match="does not exist"):
            tool(tmp_path / "nothing.usda")
        for name in ("notes.usda", "frames.npz"):
            with refused("be a USD file that can be read"):
                tool(tmp_path / name)


# The command line


def test_commands(good, copy, capfd):
    assert cli.main(["usd", "check", str(good / "out.usda")]) == 0
    assert "no faults" in capfd.readouterr().out
    assert cli.main(["usd", "info", str(good / "out.usda")]) == 0
    assert "/World/env_####/beads" in capfd.readouterr().out
    assert cli.main(["usd", "pack", str(good / "out.usda"), "--out", str(copy / "a.usdc")]) == 0
    assert "6 frames" in capfd.readouterr().out
    (copy / "out.clips" / f"f.{PLANT:06d}.usdc").unlink()
    (copy / "out.clips" / f"f.{FRAMES:06d}.usdc").write_bytes(b"")
    assert cli.main(["usd", "check", str(copy / "out.usda")]) == 1
    output = capfd.readouterr()
    assert len(output.out.splitlines()) == 2 and output.err == ""  # nor do USD's own warnings show


@pytest.mark.parametrize(
    "words",
    [["info", "none.usda"], ["check", "none.usda"], ["pack", "none.usda", "--out", "a.usdc"]],
)
def test_commands_without_a_file(words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["usd", *words]) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: ") and error.count("\n") == 1 and "none.usda" in error


@pytest.mark.parametrize("name", ready_scenes())
def test_ready_scenes_have_no_faults(name, tmp_path):
    module = load_scene(name)
    sim = ps.Simulation(module.build(**SMALL.get(name, {})), module.settings, device="cpu")
    sim.run(2, record=tmp_path / "out.usda")
    assert check(tmp_path / "out.usda") == []
