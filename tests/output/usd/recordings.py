"""Recordings of random motion, and how they are read back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from pxr import Usd, UsdGeom, UsdValidation, Vt

from particlesim.output.usd.checking.check import check
from particlesim.output.usd.description import PointsPrim, StageInfo
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


def motion(frames: int, count: int = COUNT) -> np.ndarray:
    """Random positions and velocities, (2, frames, count, 3), in single precision."""
    rng = np.random.default_rng(1)
    return rng.normal(size=(2, frames, count, 3)).astype(np.float32)


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


ROOM = "/World/env_0000"


def checked(path):
    """The stage, in which neither usd-core's validators nor ours find a fault at any frame."""
    assert check(path) == []
    return Usd.Stage.Open(str(path))


def value(stage, path, frame):
    return np.array(stage.GetAttributeAtPath(path).Get(frame))
