"""Every fault that is planted in a good recording is found."""

from pathlib import Path

import numpy as np
import pytest
from pxr import Gf, Sdf, Vt

import particlesim as ps
from cases.ready import small, swept
from particlesim.output.usd.checking.check import check
from particlesim.output.usd.checking.fault import Fault
from particlesim.output.usd.info import info
from particlesim.output.usd.pack import pack

from .stages import COUNT, FRAMES, PLANT, build, vectors

Types = Sdf.ValueTypeNames


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


def test_a_damaged_manifest(copy):
    manifest = copy / "out.clips" / "manifest.usda"
    manifest.write_text(manifest.read_text()[:500])
    is_one(check(copy / "out.usda"), "manifest", "/World", "clips", None)
    with pytest.raises(ValueError, match="manifest"):
        pack(copy / "out.usda", copy / "new.usdc")
    with pytest.raises(OSError, match=r"manifest\.usda"):
        info(copy / "out.usda")


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


@pytest.mark.parametrize("name", swept())
def test_ready_scenes_have_no_faults(name, tmp_path):
    module, scene = small(name)
    sim = ps.Simulation(scene, module.settings, device="cpu")
    sim.run(2, record=tmp_path / "out.usda")
    assert check(tmp_path / "out.usda") == []
