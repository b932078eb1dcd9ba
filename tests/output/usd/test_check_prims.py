"""Faults of prims that a recording may hold, made by hand."""

import numpy as np
from pxr import Gf, UsdGeom

from particlesim.output.usd.checking.check import check

from .stages import spheres, surface, vectors


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
