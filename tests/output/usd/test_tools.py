"""Looking into USD files and packing them, and the commands for it."""

import numpy as np
import pytest
from pxr import Usd

from particlesim import cli
from particlesim.output.usd.checking.check import check
from particlesim.output.usd.info import info
from particlesim.output.usd.pack import pack

from .stages import COUNT, FRAMES, PLANT, spheres, surface

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
