"""Authoring of single prims and attributes by Sdf."""

from __future__ import annotations

from typing import Any

import numpy as np
from pxr import Gf, Sdf, Vt

from .geometry import extent

Types = Sdf.ValueTypeNames


def vectors(array: np.ndarray) -> Vt.Vec3fArray:
    """(n, 3) numbers as USD's vectors."""
    return Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(array, dtype=np.float32))


def integers(array: np.ndarray) -> Vt.IntArray:
    """Whole numbers of 32 bits, of any shape, one after the other."""
    return Vt.IntArray.FromNumpy(np.ascontiguousarray(array, dtype=np.int32).ravel())


def floats(array: Any) -> Vt.FloatArray:
    """One number or (n,)."""
    return Vt.FloatArray.FromNumpy(np.atleast_1d(np.asarray(array, dtype=np.float32)))


def define(layer: Sdf.Layer, path: Sdf.Path, type_name: str) -> Sdf.PrimSpec:
    """A prim of a type, under Xforms."""
    parent = path.GetParentPath()
    if not parent.IsAbsoluteRootPath() and not layer.GetPrimAtPath(parent):
        define(layer, parent, "Xform")
    spec = Sdf.CreatePrimInLayer(layer, path)
    spec.specifier, spec.typeName = Sdf.SpecifierDef, type_name
    return spec


def author(
    spec: Sdf.PrimSpec,
    name: str,
    kind: Sdf.ValueTypeName,
    value: Any = None,
    interpolation: str = "",
    uniform: bool = False,
) -> Sdf.AttributeSpec:
    """Author an attribute; without a value it is declared only."""
    variability = Sdf.VariabilityUniform if uniform else Sdf.VariabilityVarying
    attribute = Sdf.AttributeSpec(spec, name, kind, variability)
    if value is not None:
        attribute.default = value
    if interpolation:
        attribute.SetInfo("interpolation", interpolation)
    return attribute


def relate(spec: Sdf.PrimSpec, name: str, target: Sdf.Path) -> None:
    """Author a relationship to one prim."""
    relationship = Sdf.RelationshipSpec(spec, name, custom=False)
    relationship.targetPathList.explicitItems.append(target)


def place(spec: Sdf.PrimSpec, pose: Gf.Matrix4d | None) -> None:
    """Author the prim's one transform; None: it comes with the clips."""
    _transform(spec, "xformOp:transform", Types.Matrix4d, pose)


def shift(spec: Sdf.PrimSpec, offset: np.ndarray) -> None:
    """Author the prim's one transform, a translation."""
    _transform(spec, "xformOp:translate", Types.Double3, Gf.Vec3d(*map(float, offset)))


def _transform(spec: Sdf.PrimSpec, name: str, kind: Sdf.ValueTypeName, value: Any) -> None:
    author(spec, name, kind, value)
    author(spec, "xformOpOrder", Types.TokenArray, Vt.TokenArray([name]), uniform=True)


def matrix(pose: np.ndarray) -> Gf.Matrix4d:
    """(4, 4) numbers as USD's matrix; both are for points in rows."""
    return Gf.Matrix4d(*pose.ravel().tolist())


def straight(spec: Sdf.PrimSpec, count: int | None, width: float) -> None:
    """Make curves of two points each, of one width; None: how many comes with the clips."""
    author(spec, "type", Types.Token, "linear", uniform=True)
    author(spec, "widths", Types.FloatArray, floats(width), "constant")
    if count is not None:
        author(spec, "curveVertexCounts", Types.IntArray, integers(np.full(count, 2)))


def surface(spec: Sdf.PrimSpec) -> None:
    """Make a mesh what its polygons are, seen from both sides."""
    author(spec, "subdivisionScheme", Types.Token, "none", uniform=True)
    author(spec, "doubleSided", Types.Bool, True, uniform=True)


def polygons(spec: Sdf.PrimSpec, faces: np.ndarray) -> None:
    """Give a mesh its faces (m, k), for good."""
    count, corners = faces.shape
    author(spec, "faceVertexCounts", Types.IntArray, integers(np.full(count, corners)))
    author(spec, "faceVertexIndices", Types.IntArray, integers(faces))


def still(spec: Sdf.PrimSpec, points: np.ndarray, width: float) -> None:
    """Give points that never move."""
    author(spec, "points", Types.Point3fArray, vectors(points))
    author(spec, "extent", Types.Float3Array, vectors(extent(points, width)))
