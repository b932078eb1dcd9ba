"""Fixtures of several tests of USD files."""

import shutil
from pathlib import Path

import pytest
from pxr import Usd, UsdGeom

import particlesim as ps
from particlesim.output.usd.pack import pack

from .stages import FRAMES, build


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
