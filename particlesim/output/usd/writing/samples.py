"""What the clips of a USD recording hold: the values that change, frame by frame.

The same attributes are declared in the root and in the manifest, without a default, for a default
in the root would hide the clips.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from pxr import Sdf, Vt

from ..description import LinksPrim, MeshPrim, PointsPrim, StageInfo
from ..layout import Layout, outlines
from .frame import KINDS, Frame, Surface, primvar
from .geometry import extent
from .prims import Types, author, floats, integers, matrix, vectors

Fields = Mapping[str, int | str]


def manifest(paths: Layout, fields: Fields, info: StageInfo) -> Sdf.Layer:
    """A layer that declares what clips hold: the manifest, and the mould of every clip."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.timeCodesPerSecond = layer.framesPerSecond = info.fps
    with Sdf.ChangeBlock():
        for prim, path in zip(info.points, paths.points, strict=True):
            declare_points(Sdf.CreatePrimInLayer(layer, path), prim, fields)
        for links, path in zip(info.links, paths.links, strict=True):
            declare_links(Sdf.CreatePrimInLayer(layer, path), links)
        for mesh, path in zip(info.meshes, paths.meshes, strict=True):
            declare_mesh(Sdf.CreatePrimInLayer(layer, path), mesh, fields)
        for shape, path in zip(info.shapes, paths.shapes, strict=True):
            if shape.moving:
                author(Sdf.CreatePrimInLayer(layer, path), "xformOp:transform", Types.Matrix4d)
        for path in outlines(info) if info.flexible else ():
            author(Sdf.CreatePrimInLayer(layer, path), "xformOp:transform", Types.Matrix4d)
    return layer


def declare_points(spec: Sdf.PrimSpec, prim: PointsPrim, fields: Fields) -> None:
    """What clips hold of a group."""
    author(spec, "positions" if prim.instancer else "points", Types.Point3fArray)
    author(spec, "velocities", Types.Vector3fArray)
    author(spec, "extent", Types.Float3Array)
    if prim.indices is None:
        author(spec, "ids", Types.Int64Array)
        author(spec, "primvars:pid", Types.IntArray, interpolation="vertex")
        if prim.instancer:
            author(spec, "protoIndices", Types.IntArray)
    if "widths" in fields:
        if prim.instancer:
            author(spec, "scales", Types.Float3Array)
        else:
            author(spec, "widths", Types.FloatArray, interpolation="vertex")
    _declare_fields(spec, fields)


def declare_links(spec: Sdf.PrimSpec, prim: LinksPrim) -> None:
    """What clips hold of links."""
    author(spec, "points", Types.Point3fArray)
    author(spec, "extent", Types.Float3Array)
    if prim.pairs is None:
        author(spec, "curveVertexCounts", Types.IntArray)


def declare_mesh(spec: Sdf.PrimSpec, prim: MeshPrim, fields: Fields) -> None:
    """What clips hold of a surface."""
    author(spec, "points", Types.Point3fArray)
    author(spec, "normals", Types.Normal3fArray, interpolation="vertex")
    author(spec, "extent", Types.Float3Array)
    if prim.triangles is None:
        author(spec, "faceVertexCounts", Types.IntArray)
        author(spec, "faceVertexIndices", Types.IntArray)
    if prim.indices is not None:
        author(spec, "velocities", Types.Vector3fArray)
        _declare_fields(spec, fields)


def _declare_fields(spec: Sdf.PrimSpec, fields: Fields) -> None:
    for name, kind in fields.items():
        if name != "widths":
            author(spec, f"primvars:{primvar(name)}", KINDS[kind], interpolation="vertex")


def fill_clip(clip: Sdf.Layer, paths: Layout, info: StageInfo, frame: Frame) -> None:
    """Put one frame into the clip's layer, instead of the one before."""

    def put(path: Sdf.Path, values: Iterator[tuple[str, Any]]) -> None:
        for name, value in values:
            at = path.AppendProperty(name)
            clip.EraseTimeSample(at, frame.number - 1)
            clip.SetTimeSample(at, frame.number, value)

    with Sdf.ChangeBlock():
        clip.customLayerData = {"particlesim": frame.notes} if frame.notes else {}
        for prim, path, (rows, ids) in zip(info.points, paths.points, frame.clouds, strict=True):
            put(path, _points(prim, frame, rows, ids))
        for links, path, pairs in zip(info.links, paths.links, frame.pairs, strict=True):
            put(path, _links(links, info, frame, pairs))
        for path, surface in zip(paths.meshes, frame.surfaces, strict=True):
            put(path, _mesh(frame, surface))
        for path, pose in zip(paths.shapes, frame.poses, strict=True):
            if pose is not None:
                put(path, iter([("xformOp:transform", matrix(pose))]))
        for path in outlines(info) if info.flexible else ():
            put(path, iter([("xformOp:transform", matrix(_stretch(info, frame)))]))


def _stretch(info: StageInfo, frame: Frame) -> np.ndarray:
    """What takes the outline of the box at the start to that of the frame, (4, 4)."""
    lower, upper = info.periodic
    ratio = np.asarray(frame.box) / (upper - lower)
    pose = np.diag([*ratio, 1.0])
    pose[3, :3] = lower * (1.0 - ratio)
    return pose


def _points(
    prim: PointsPrim, frame: Frame, rows: Any, ids: np.ndarray | None
) -> Iterator[tuple[str, Any]]:
    x, widths = frame.x[rows], frame.widths(prim, rows)
    yield "positions" if prim.instancer else "points", vectors(x)
    yield "velocities", vectors(frame.v[rows])
    yield "extent", vectors(extent(x, widths))
    if ids is not None:
        yield "ids", Vt.Int64Array.FromNumpy(ids)
        yield "primvars:pid", integers(ids)
        if prim.instancer:
            yield "protoIndices", integers(np.zeros(len(ids)))
    if "widths" in frame.fields:
        if prim.instancer:
            yield "scales", vectors(np.repeat(np.asarray(widths)[:, None], 3, axis=1))
        else:
            yield "widths", floats(widths)
    yield from _fields(frame, rows)


def _links(
    prim: LinksPrim, info: StageInfo, frame: Frame, pairs: np.ndarray
) -> Iterator[tuple[str, Any]]:
    points = _segments(pairs, info, frame)
    yield "points", vectors(points)
    yield "extent", vectors(extent(points, prim.width))
    if prim.pairs is None:
        yield "curveVertexCounts", integers(np.full(len(pairs), 2))


def _segments(pairs: np.ndarray, info: StageInfo, frame: Frame) -> np.ndarray:
    """Ends of the links, (2 m, 3); in a periodic box the second is its image next to the first."""
    ends = frame.x[pairs]
    if info.periodic is not None:
        size = info.periodic[1] - info.periodic[0] if frame.box is None else frame.box
        around = ~np.isnan(size)
        apart = (ends[:, 1] - ends[:, 0])[:, around]
        ends[:, 1, around] -= np.round(apart / size[around]) * size[around]
    return ends.reshape(-1, 3)


def _mesh(frame: Frame, surface: Surface) -> Iterator[tuple[str, Any]]:
    yield "points", vectors(surface.points)
    yield "normals", vectors(surface.normals)
    yield "extent", vectors(extent(surface.points, None))
    if surface.triangles is not None:
        yield "faceVertexCounts", integers(np.full(len(surface.triangles), 3))
        yield "faceVertexIndices", integers(surface.triangles)
    if surface.velocities is not None:
        yield "velocities", vectors(surface.velocities)
        yield from _fields(frame, surface.rows)


def _fields(frame: Frame, rows: Any) -> Iterator[tuple[str, Any]]:
    for name, values in frame.fields.items():
        if name == "widths":
            continue
        if values.ndim == 2:
            yield f"primvars:{name}", vectors(values[rows])
        elif np.issubdtype(values.dtype, np.integer):
            yield f"primvars:{name}", integers(values[rows])
        else:
            yield f"primvars:{name}", floats(values[rows])
