"""What is inside the root layer of a USD recording.

    /World                             Xform; says where the value clips are
    /World/camera, lights, materials
    /World/periodic_box                BasisCurves, the outline; below each world in a layout
    /World/env_0000                    Xform, one a world, moved by the layout
    /World/env_0000/<group>            Points; or PointInstancer, with its sphere below
    /World/env_0000/<links>            BasisCurves
    /World/env_0000/<surface>          Mesh
    /World/env_0000/boundaries/<name>  Mesh; for a box, faces and edges below

Layers are authored by Sdf in change blocks, for a stage would recompose itself at every value.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable

import numpy as np
from pxr import Sdf, Vt

from ..description import Color, LinksPrim, MeshPrim, PointsPrim, Shape, StageInfo
from ..layout import WORLD, Layout, outlines, room
from .frame import Frame
from .geometry import (
    CORNERS,
    EDGES,
    FACES,
    extent,
    joined,
    posed_plane,
    square_on,
    unit_sphere,
    viewpoint,
    world_boxes,
)
from .look import CLEAR, Materials, author_camera, author_lights
from .prims import (
    Types,
    author,
    define,
    floats,
    integers,
    place,
    polygons,
    relate,
    shift,
    still,
    straight,
    surface,
    vectors,
)
from .samples import Fields, declare_links, declare_mesh, declare_points

BALL_CUTS = 6  # of a cube's side that becomes an instanced sphere: 216 quads


def sized(info: StageInfo, clouds: Iterable[np.ndarray]) -> StageInfo:
    """The description with a width wherever it has None.

    Args:
        info: The description.
        clouds: Positions of every group in the first frame, (n, 3) each.
    """
    if all(prim.widths is not None for prim in info.points):
        return info
    box = joined(extent(points, None) for points in clouds)
    width = 0.01 * float(np.linalg.norm(box[1] - box[0])) or 0.01
    points = [
        dataclasses.replace(prim, widths=width) if prim.widths is None else prim
        for prim in info.points
    ]
    return dataclasses.replace(info, points=points)


def author_root(paths: Layout, info: StageInfo, fields: Fields, frame: Frame) -> Sdf.Layer:
    """The root's layer, framed on the first frame."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.defaultPrim = WORLD.name
    layer.timeCodesPerSecond = layer.framesPerSecond = info.fps
    layer.pseudoRoot.SetInfo("metersPerUnit", info.meters_per_unit)
    layer.pseudoRoot.SetInfo("upAxis", info.up_axis.upper())
    # The rate once more: a tool that changed one of the others would have changed the velocities.
    made = {"fps": info.fps} | ({"frameTime": info.frame_time} if info.frame_time else {})
    layer.customLayerData = {"particlesim": made}
    with Sdf.ChangeBlock():
        root = _Root(layer, info, frame)
        for prim, path in zip(info.points, paths.points, strict=True):
            (root.instancer if prim.instancer else root.points)(prim, path, fields)
        for links, path in zip(info.links, paths.links, strict=True):
            root.links(links, path)
        for mesh, path in zip(info.meshes, paths.meshes, strict=True):
            root.mesh(mesh, path, fields)
        for shape, path, pose in zip(info.shapes, paths.shapes, frame.poses, strict=True):
            root.shape(shape, path, pose)
        if info.periodic is not None:
            root.periodic_boxes()
        author_camera(layer, root.axes, root.eye, root.distance)
        author_lights(layer, root.axes)
    return layer


class _Root:
    """Authors the prims of a root layer."""

    def __init__(self, layer: Sdf.Layer, info: StageInfo, frame: Frame):
        self.layer, self.info = layer, info
        self.materials = Materials(layer)
        self.boxes = world_boxes(info, frame)
        self.box = joined(box + info.offset(world) for world, box in self.boxes.items())
        self.diagonal = float(np.linalg.norm(self.box[1] - self.box[0])) or 1.0
        up = np.array([0.0, 1.0, 0.0] if info.up_axis == "y" else [0.0, 0.0, 1.0])
        out = np.array([0.0, 0.0, 1.0] if info.up_axis == "y" else [0.0, -1.0, 0.0])
        self.axes = np.array([[1.0, 0.0, 0.0], up, out])
        self.eye, self.distance = viewpoint(self.box, self.axes, self.diagonal)
        define(layer, WORLD, "Xform")
        for world in info.worlds:
            spec = define(layer, room(world), "Xform")
            if info.layout:
                shift(spec, info.offset(world))

    def points(self, prim: PointsPrim, path: Sdf.Path, fields: Fields) -> None:
        colored = "displayColor" in fields
        spec = self.materials.gprim(path, "Points", prim.name, prim.color, colored=colored)
        declare_points(spec, prim, fields)
        if "widths" not in fields:
            each = "vertex" if isinstance(prim.widths, np.ndarray) else "constant"
            author(spec, "widths", Types.FloatArray, floats(prim.widths), each)
        if prim.ids is not None:
            _identify(spec, prim.ids)

    def instancer(self, prim: PointsPrim, path: Sdf.Path, fields: Fields) -> None:
        """Spheres: copies of one, of the particles' size or scaled to it."""
        spec = define(self.layer, path, "PointInstancer")
        declare_points(spec, prim, fields)
        radius = 0.5  # for scales that are diameters
        if "widths" not in fields and isinstance(prim.widths, np.ndarray):
            scales = np.repeat(prim.widths[:, None], 3, axis=1)
            author(spec, "scales", Types.Float3Array, vectors(scales))
        elif "widths" not in fields:
            radius *= float(prim.widths or 0.0)
        if prim.ids is not None:
            _identify(spec, prim.ids)
            author(spec, "protoIndices", Types.IntArray, integers(np.zeros(len(prim.ids))))
        ball = path.AppendPath("prototypes/ball")
        relate(spec, "prototypes", ball)
        colored = "displayColor" in fields
        mesh = self.materials.gprim(ball, "Mesh", prim.name, prim.color, colored=colored)
        self._sphere(mesh, np.zeros(3), radius, BALL_CUTS)

    def links(self, prim: LinksPrim, path: Sdf.Path) -> None:
        spec = self.materials.gprim(path, "BasisCurves", prim.name, prim.color)
        declare_links(spec, prim)
        straight(spec, None if prim.pairs is None else len(prim.pairs), prim.width)

    def mesh(self, prim: MeshPrim, path: Sdf.Path, fields: Fields) -> None:
        colored = prim.indices is not None and "displayColor" in fields
        spec = self.materials.gprim(path, "Mesh", prim.name, prim.color, colored=colored)
        declare_mesh(spec, prim, fields)
        surface(spec)
        if prim.triangles is not None:
            polygons(spec, prim.triangles)

    def outline(self, path: Sdf.Path, box: np.ndarray, color: Color) -> Sdf.PrimSpec:
        """The edges of a box."""
        spec = self.materials.gprim(path, "BasisCurves", "outline", color)
        points = (box[0] + CORNERS * (box[1] - box[0]))[np.ravel(EDGES)]
        width = 0.002 * self.diagonal
        straight(spec, len(EDGES), width)
        still(spec, points, width)
        return spec

    def periodic_boxes(self) -> None:
        """One outline, or one a world where they are laid out."""
        # On an open axis the outline is as long as what there is to see.
        every = self.boxes.values() if self.info.layout else [self.box]
        for path, seen in zip(outlines(self.info), every, strict=True):
            box = np.where(np.isnan(self.info.periodic), seen, self.info.periodic)
            spec = self.outline(path, box, (0.5, 0.5, 0.5))
            if self.info.flexible:
                place(spec, None)

    def shape(self, shape: Shape, path: Sdf.Path, pose: np.ndarray | None) -> None:
        first, second = shape.parameters
        clear = shape.clear
        if shape.kind == "plane":
            spec = self._plane(shape, path, pose)
        elif shape.kind == "box":
            corners = first + CORNERS * (second - first)
            spec = define(self.layer, path, "Xform")
            self._still(path.AppendChild("faces"), corners, FACES, shape, clear)
            self.outline(path.AppendChild("edges"), np.array([first, second]), shape.color)
        elif shape.kind == "mesh":
            spec = self._still(path, first, second, shape, clear)
        else:
            # No UsdGeomSphere: Blender gives those no material, so that a clear one hid particles.
            spec = self._boundary(path, shape, clear)
            self._sphere(spec, first, second, 16)
        if shape.moving:
            place(spec, None)

    def _plane(self, shape: Shape, path: Sdf.Path, pose: np.ndarray | None) -> Sdf.PrimSpec:
        """A square of the plane around what there is to see, in the space before the pose."""
        offset = self.info.offset(shape.world)
        point, normal = posed_plane(shape, pose)
        behind = bool(np.dot(self.eye - offset - point, normal) <= 0)
        # Where worlds are laid out, each stands on its own ground.
        own = self.boxes[shape.world] if self.info.layout else self.box
        half = (0.75 if self.info.layout else 2.0) * float(np.linalg.norm(own[1] - own[0]))
        corners = square_on(own, point, normal, half or 1.0)
        if pose is not None:
            corners = (corners - pose[3, :3]) @ pose[:3, :3].T
        return self._still(path, corners, np.arange(4)[None], shape, shape.clear or behind)

    def _boundary(self, path: Sdf.Path, shape: Shape, clear: bool) -> Sdf.PrimSpec:
        """The mesh of a boundary, without its points."""
        material, opacity = ("clear", CLEAR) if clear else ("boundary", 1.0)
        return self.materials.gprim(path, "Mesh", material, shape.color, opacity)

    def _still(
        self, path: Sdf.Path, points: np.ndarray, faces: np.ndarray, shape: Shape, clear: bool
    ) -> Sdf.PrimSpec:
        """A boundary of faces (m, k) between points (n, 3)."""
        spec = self._boundary(path, shape, clear)
        surface(spec)
        polygons(spec, faces)
        still(spec, points, 0.0)
        return spec

    def _sphere(self, spec: Sdf.PrimSpec, center: np.ndarray, radius: float, cuts: int) -> None:
        normals, faces = unit_sphere(cuts)
        surface(spec)
        polygons(spec, faces)
        still(spec, center + radius * normals, 0.0)
        author(spec, "normals", Types.Normal3fArray, vectors(normals), "vertex")


def _identify(spec: Sdf.PrimSpec, ids: np.ndarray) -> None:
    """Numbers of the particles that never change."""
    author(spec, "ids", Types.Int64Array, Vt.Int64Array.FromNumpy(ids))
    # Blender ignores ids, and drops what comes after a primvar of 64-bit integers.
    author(spec, "primvars:pid", Types.IntArray, integers(ids), "vertex")
