"""What is inside the layers of a USD recording: the root, the manifest and the clips.

    /World                             Xform; says where the value clips are
    /World/camera, lights, materials
    /World/periodic_box                BasisCurves, the outline
    /World/env_0000                    Xform, one a world
    /World/env_0000/<group>            Points
    /World/env_0000/<links>            BasisCurves
    /World/env_0000/boundaries/<name>  Mesh; for a box, faces and edges below

Values that change are declared in the root without a default, for a default would hide the clips.
Layers are authored by Sdf in change blocks, for a stage would recompose itself at every value.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from pxr import Gf, Sdf, Tf, Vt

from .usd_geometry import (
    APERTURE,
    CORNERS,
    EDGES,
    FACES,
    FOCAL_LENGTH,
    VIEW,
    bounding_box,
    extent,
    pose_of,
    square_on,
    unit_sphere,
    viewpoint,
)

if TYPE_CHECKING:
    from .usd_info import Color, LinksPrim, PointsPrim, Shape, StageInfo

Types = Sdf.ValueTypeNames
WORLD = Sdf.Path("/World")
CLEAR = 0.1  # opacity of what particles are inside of


@dataclass(frozen=True)
class Layout:
    """Prim paths, in the order of the description."""

    points: list[Sdf.Path]
    links: list[Sdf.Path]
    shapes: list[Sdf.Path]


def layout(info: StageInfo) -> Layout:
    """Where every prim goes: names made valid, and unique within their world."""
    taken: set[Sdf.Path] = set()

    def place(world: int, name: str, room: str = "") -> Sdf.Path:
        parent = WORLD.AppendPath(f"env_{world:04d}{room}")
        taken.add(parent.AppendChild("boundaries"))
        base = Tf.MakeValidIdentifier(name)
        path, number = parent.AppendChild(base), 1
        while path in taken:
            number += 1
            path = parent.AppendChild(f"{base}_{number}")
        taken.add(path)
        return path

    return Layout(
        [place(prim.world, prim.name) for prim in info.points],
        [place(prim.world, prim.name) for prim in info.links],
        [place(shape.world, shape.name, "/boundaries") for shape in info.shapes],
    )


def primvar(name: str) -> str:
    """Name of a field's primvar, without the namespace."""
    return Tf.MakeValidIdentifier(name)


def sized(info: StageInfo, x: np.ndarray) -> StageInfo:
    """The description with a width wherever it has None, from the first frame's positions."""
    if all(prim.widths is not None for prim in info.points):
        return info
    corners = np.array([extent(x[prim.indices], None) for prim in info.points])
    width = 0.01 * float(np.linalg.norm(corners[:, 1].max(axis=0) - corners[:, 0].min(axis=0)))
    points = [
        dataclasses.replace(prim, widths=width or 0.01) if prim.widths is None else prim
        for prim in info.points
    ]
    return dataclasses.replace(info, points=points)


def manifest(paths: Layout, fields: dict[str, int], info: StageInfo) -> Sdf.Layer:
    """A layer that declares what clips hold: the manifest, and the mould of every clip."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.timeCodesPerSecond = layer.framesPerSecond = info.fps
    with Sdf.ChangeBlock():
        for path in paths.points:
            _declare_points(Sdf.CreatePrimInLayer(layer, path), fields)
        for path in paths.links:
            _declare_links(Sdf.CreatePrimInLayer(layer, path))
    return layer


def fill_clip(
    clip: Sdf.Layer,
    paths: Layout,
    info: StageInfo,
    frame: int,
    x: np.ndarray,
    v: np.ndarray,
    fields: dict[str, np.ndarray],
) -> None:
    """Put one frame into the clip's layer, instead of the one before."""

    def put(path: Sdf.Path, attribute: str, value: Any) -> None:
        at = path.AppendProperty(attribute)
        clip.EraseTimeSample(at, frame - 1)
        clip.SetTimeSample(at, frame, value)

    with Sdf.ChangeBlock():
        for prim, path in zip(info.points, paths.points, strict=True):
            points = x[prim.indices]
            put(path, "points", _vectors(points))
            put(path, "velocities", _vectors(v[prim.indices]))
            put(path, "extent", _vectors(extent(points, prim.widths)))
            for name, values in fields.items():
                array = Vt.FloatArray if values.ndim == 1 else Vt.Vec3fArray
                put(path, f"primvars:{name}", array.FromNumpy(values[prim.indices]))
        for links, path in zip(info.links, paths.links, strict=True):
            points = _segments(links, info, x)
            put(path, "points", _vectors(points))
            put(path, "extent", _vectors(extent(points, links.width)))


def _segments(prim: LinksPrim, info: StageInfo, x: np.ndarray) -> np.ndarray:
    """Ends of the links, (2 m, 3); in a periodic box the second is its image next to the first."""
    ends = x[prim.pairs]
    if info.periodic is not None:
        size = info.periodic[1] - info.periodic[0]
        around = ~np.isnan(size)
        apart = (ends[:, 1] - ends[:, 0])[:, around]
        ends[:, 1, around] -= np.round(apart / size[around]) * size[around]
    return ends.reshape(-1, 3)


def set_frames(root: Sdf.Layer, clips: str, first: int, last: int) -> None:
    """Tell the root its first and last frame, and where the clips of them are."""
    root.startTimeCode, root.endTimeCode = first, last
    clip_set = {
        "primPath": str(WORLD),
        "manifestAssetPath": Sdf.AssetPath(f"./{clips}/manifest.usda"),
        "templateAssetPath": f"./{clips}/f.######.usdc",
        "templateStartTime": float(first),
        "templateEndTime": float(last),
        "templateStride": 1.0,
    }
    root.GetPrimAtPath(WORLD).SetInfo("clips", {"default": clip_set})


def author_root(paths: Layout, info: StageInfo, fields: dict[str, int], x: np.ndarray) -> Sdf.Layer:
    """The root's layer, framed on the first frame's positions x (n, 3)."""
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.defaultPrim = WORLD.name
    layer.timeCodesPerSecond = layer.framesPerSecond = info.fps
    layer.pseudoRoot.SetInfo("metersPerUnit", info.meters_per_unit)
    layer.pseudoRoot.SetInfo("upAxis", info.up_axis.upper())
    if info.frame_time is not None:
        layer.customLayerData = {"particlesim": {"frameTime": info.frame_time}}
    with Sdf.ChangeBlock():
        root = _Root(layer, info, x)
        for prim, path in zip(info.points, paths.points, strict=True):
            root.points(prim, path, fields)
        for links, path in zip(info.links, paths.links, strict=True):
            root.links(links, path)
        for shape, path in zip(info.shapes, paths.shapes, strict=True):
            root.shape(shape, path)
        if info.periodic is not None:
            # On an open axis the outline is as long as what there is to see.
            box = np.where(np.isnan(info.periodic), root.box, info.periodic)
            root.outline(WORLD.AppendChild("periodic_box"), box, (0.5, 0.5, 0.5))
        root.camera()
        root.lights()
    return layer


class _Root:
    """Authors the prims of a root layer."""

    def __init__(self, layer: Sdf.Layer, info: StageInfo, x: np.ndarray):
        self.layer = layer
        self.materials: dict[tuple[str, Color, float], Sdf.Path] = {}
        self.box = bounding_box(info, x)
        self.diagonal = float(np.linalg.norm(self.box[1] - self.box[0])) or 1.0
        up = np.array([0.0, 1.0, 0.0] if info.up_axis == "y" else [0.0, 0.0, 1.0])
        out = np.array([0.0, 0.0, 1.0] if info.up_axis == "y" else [0.0, -1.0, 0.0])
        self.axes = np.array([[1.0, 0.0, 0.0], up, out])
        self.eye, self.distance = viewpoint(self.box, self.axes, self.diagonal)
        self._define(WORLD, "Xform")

    def points(self, prim: PointsPrim, path: Sdf.Path, fields: dict[str, int]) -> None:
        spec = self._gprim(path, "Points", prim.name, prim.color)
        _declare_points(spec, fields)
        widths = np.atleast_1d(np.asarray(prim.widths, dtype=np.float32))
        interpolation = "vertex" if isinstance(prim.widths, np.ndarray) else "constant"
        _set(spec, "widths", Types.FloatArray, Vt.FloatArray.FromNumpy(widths), interpolation)
        _set(spec, "ids", Types.Int64Array, Vt.Int64Array.FromNumpy(prim.ids))
        # Blender ignores ids, and drops what comes after a primvar of 64-bit integers.
        pid = Vt.IntArray.FromNumpy(prim.ids.astype(np.int32))
        _set(spec, "primvars:pid", Types.IntArray, pid, "vertex")

    def links(self, prim: LinksPrim, path: Sdf.Path) -> None:
        spec = self._gprim(path, "BasisCurves", prim.name, prim.color)
        _declare_links(spec)
        _straight(spec, len(prim.pairs), prim.width)

    def outline(self, path: Sdf.Path, box: np.ndarray, color: Color) -> None:
        """The edges of a box."""
        spec = self._gprim(path, "BasisCurves", "outline", color)
        points = (box[0] + CORNERS * (box[1] - box[0]))[np.ravel(EDGES)]
        width = 0.002 * self.diagonal
        _straight(spec, len(EDGES), width)
        _still(spec, points, width)

    def shape(self, shape: Shape, path: Sdf.Path) -> None:
        first, second = shape.parameters
        if shape.kind == "plane":
            behind = bool(np.dot(self.eye - first, second) <= 0)
            square = square_on(self.box, first, second, 2.0 * self.diagonal)
            self._mesh(path, square, np.arange(4)[None], shape, shape.container or behind)
        elif shape.kind == "box":
            corners = first + CORNERS * (second - first)
            self._mesh(path.AppendChild("faces"), corners, FACES, shape, shape.container)
            self.outline(path.AppendChild("edges"), np.array([first, second]), shape.color)
        else:
            # No UsdGeomSphere: Blender gives those no material, so that a clear one hid particles.
            normals, faces = unit_sphere(16)
            points = first + second * normals
            spec = self._mesh(path, points, faces, shape, shape.container)
            _set(spec, "normals", Types.Normal3fArray, _vectors(normals), "vertex")

    def camera(self) -> None:
        spec = self._define(WORLD.AppendChild("camera"), "Camera")
        _set(spec, "focalLength", Types.Float, FOCAL_LENGTH)
        _set(spec, "horizontalAperture", Types.Float, float(APERTURE[0]))
        _set(spec, "verticalAperture", Types.Float, float(APERTURE[1]))
        _set(spec, "focusDistance", Types.Float, self.distance)
        # Far: what flies off, and the ends of planes.
        near_and_far = Gf.Vec2f(0.01 * self.distance, 100.0 * self.distance)
        _set(spec, "clippingRange", Types.Float2, near_and_far)
        pose = pose_of(np.array(VIEW) @ self.axes, self.axes[1], self.eye)
        _place(spec, pose)

    def lights(self) -> None:
        """A light from above on the camera's side, and a sky that fills the shadows."""
        key = self._define(WORLD.AppendPath("lights/key"), "DistantLight")
        _set(key, "inputs:intensity", Types.Float, 1.0)
        _set(key, "inputs:normalize", Types.Bool, True)  # brightness does not depend on the angle
        _set(key, "inputs:angle", Types.Float, 2.0)
        pose = pose_of(np.array([-0.6, 1.2, 0.8]) @ self.axes, self.axes[1], np.zeros(3))
        _place(key, pose)
        sky = self._define(WORLD.AppendPath("lights/sky"), "DomeLight")
        _set(sky, "inputs:intensity", Types.Float, 0.5)
        # The default, but Blender's own grey sky stays where no colour is authored.
        _set(sky, "inputs:color", Types.Color3f, Gf.Vec3f(1.0))

    def _define(self, path: Sdf.Path, type_name: str) -> Sdf.PrimSpec:
        """A prim of a type, under Xforms."""
        parent = path.GetParentPath()
        if not parent.IsAbsoluteRootPath() and not self.layer.GetPrimAtPath(parent):
            self._define(parent, "Xform")
        spec = Sdf.CreatePrimInLayer(self.layer, path)
        spec.specifier, spec.typeName = Sdf.SpecifierDef, type_name
        return spec

    def _gprim(
        self, path: Sdf.Path, type_name: str, material: str, color: Color, opacity: float = 1.0
    ) -> Sdf.PrimSpec:
        """Something to see: coloured for viewers, and with a material for renderers."""
        spec = self._define(path, type_name)
        colors = Vt.Vec3fArray([Gf.Vec3f(*color)])
        _set(spec, "primvars:displayColor", Types.Color3fArray, colors, "constant")
        if opacity < 1.0:
            opacities = Vt.FloatArray([opacity])
            _set(spec, "primvars:displayOpacity", Types.FloatArray, opacities, "constant")
        spec.SetInfo("apiSchemas", Sdf.TokenListOp.Create(prependedItems=["MaterialBindingAPI"]))
        binding = Sdf.RelationshipSpec(spec, "material:binding", custom=False)
        binding.targetPathList.explicitItems.append(self._material(material, color, opacity))
        return spec

    def _material(self, name: str, color: Color, opacity: float) -> Sdf.Path:
        key = (name, color, opacity)
        if key not in self.materials:
            path = WORLD.AppendPath(f"materials/{Tf.MakeValidIdentifier(name)}")
            while self.layer.GetPrimAtPath(path):
                path = path.ReplaceName(f"{path.name}_")
            material = self._define(path, "Material")
            shader = self._define(path.AppendChild("surface"), "Shader")
            _set(shader, "info:id", Types.Token, "UsdPreviewSurface", uniform=True)
            _set(shader, "inputs:diffuseColor", Types.Color3f, Gf.Vec3f(*color))
            _set(shader, "inputs:roughness", Types.Float, 0.5)
            _set(shader, "inputs:opacity", Types.Float, opacity)
            output = _set(shader, "outputs:surface", Types.Token)
            surface = _set(material, "outputs:surface", Types.Token)
            surface.connectionPathList.explicitItems.append(output.path)
            self.materials[key] = path
        return self.materials[key]

    def _mesh(
        self, path: Sdf.Path, points: np.ndarray, faces: np.ndarray, shape: Shape, clear: bool
    ) -> Sdf.PrimSpec:
        """A surface of quads, (m, 4) int."""
        material, opacity = ("clear", CLEAR) if clear else ("boundary", 1.0)
        spec = self._gprim(path, "Mesh", material, shape.color, opacity)
        _set(spec, "faceVertexCounts", Types.IntArray, Vt.IntArray([4] * len(faces)))
        _set(spec, "faceVertexIndices", Types.IntArray, Vt.IntArray(faces.ravel().tolist()))
        _set(spec, "subdivisionScheme", Types.Token, "none", uniform=True)
        _set(spec, "doubleSided", Types.Bool, True, uniform=True)
        _still(spec, points, 0.0)
        return spec


def _declare_points(spec: Sdf.PrimSpec, fields: dict[str, int]) -> None:
    """What clips hold of a group."""
    _set(spec, "points", Types.Point3fArray)
    _set(spec, "velocities", Types.Vector3fArray)
    _set(spec, "extent", Types.Float3Array)
    for name, width in fields.items():
        kind = Types.FloatArray if width == 1 else Types.Float3Array
        _set(spec, f"primvars:{primvar(name)}", kind, interpolation="vertex")


def _declare_links(spec: Sdf.PrimSpec) -> None:
    """What clips hold of links."""
    _set(spec, "points", Types.Point3fArray)
    _set(spec, "extent", Types.Float3Array)


def _straight(spec: Sdf.PrimSpec, count: int, width: float) -> None:
    """Make curves of two points each, of one width."""
    _set(spec, "type", Types.Token, "linear", uniform=True)
    _set(spec, "curveVertexCounts", Types.IntArray, Vt.IntArray([2] * count))
    _set(spec, "widths", Types.FloatArray, Vt.FloatArray([width]), "constant")


def _still(spec: Sdf.PrimSpec, points: np.ndarray, width: float) -> None:
    """Give points that never move."""
    _set(spec, "points", Types.Point3fArray, _vectors(points))
    _set(spec, "extent", Types.Float3Array, _vectors(extent(points, width)))


def _set(
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


def _place(spec: Sdf.PrimSpec, pose: Gf.Matrix4d) -> None:
    """Author the prim's one transform."""
    _set(spec, "xformOp:transform", Types.Matrix4d, pose)
    order = Vt.TokenArray(["xformOp:transform"])
    _set(spec, "xformOpOrder", Types.TokenArray, order, uniform=True)


def _vectors(array: np.ndarray) -> Vt.Vec3fArray:
    return Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(array, dtype=np.float32))
