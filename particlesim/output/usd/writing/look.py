"""How a recording is seen: materials, a camera and lights."""

from __future__ import annotations

import numpy as np
from pxr import Gf, Sdf, Tf, Vt

from ..description import Color
from ..layout import WORLD
from .geometry import APERTURE, FOCAL_LENGTH, VIEW, pose_of
from .prims import Types, author, define, floats, place, relate

CLEAR = 0.1  # opacity of what particles are inside of


class Materials:
    """The materials of a root layer, each authored when it is first needed."""

    def __init__(self, layer: Sdf.Layer):
        self.layer = layer
        self.made: dict[tuple[str, Color, float, bool], Sdf.Path] = {}

    def gprim(
        self,
        path: Sdf.Path,
        type_name: str,
        material: str,
        color: Color,
        opacity: float = 1.0,
        colored: bool = False,
    ) -> Sdf.PrimSpec:
        """Something to see, coloured for viewers and with a material for renderers.

        ``colored``: the colours of its points come with the clips.
        """
        spec = define(self.layer, path, type_name)
        if not colored:
            colors = Vt.Vec3fArray([Gf.Vec3f(*color)])
            author(spec, "primvars:displayColor", Types.Color3fArray, colors, "constant")
        if opacity < 1.0:
            author(spec, "primvars:displayOpacity", Types.FloatArray, floats(opacity), "constant")
        self.bind(spec, material, color, opacity, colored)
        return spec

    def bind(
        self, spec: Sdf.PrimSpec, name: str, color: Color, opacity: float, colored: bool
    ) -> None:
        """Bind the material of these properties."""
        key = (name, color, opacity, colored)
        if key not in self.made:
            self.made[key] = self._author(*key)
        spec.SetInfo("apiSchemas", Sdf.TokenListOp.Create(prependedItems=["MaterialBindingAPI"]))
        relate(spec, "material:binding", self.made[key])

    def _author(self, name: str, color: Color, opacity: float, colored: bool) -> Sdf.Path:
        path = WORLD.AppendPath(f"materials/{Tf.MakeValidIdentifier(name)}")
        while self.layer.GetPrimAtPath(path):
            path = path.ReplaceName(f"{path.name}_")
        material = define(self.layer, path, "Material")
        shader = define(self.layer, path.AppendChild("surface"), "Shader")
        author(shader, "info:id", Types.Token, "UsdPreviewSurface", uniform=True)
        diffuse = author(shader, "inputs:diffuseColor", Types.Color3f, Gf.Vec3f(*color))
        if colored:
            diffuse.connectionPathList.explicitItems.append(self._reader(path, color))
        author(shader, "inputs:roughness", Types.Float, 0.5)
        author(shader, "inputs:opacity", Types.Float, opacity)
        output = author(shader, "outputs:surface", Types.Token)
        surface = author(material, "outputs:surface", Types.Token)
        surface.connectionPathList.explicitItems.append(output.path)
        return path

    def _reader(self, path: Sdf.Path, fallback: Color) -> Sdf.Path:
        """The output of a shader that reads the colour of each point."""
        reader = define(self.layer, path.AppendChild("colors"), "Shader")
        author(reader, "info:id", Types.Token, "UsdPrimvarReader_float3", uniform=True)
        author(reader, "inputs:varname", Types.String, "displayColor")
        author(reader, "inputs:fallback", Types.Float3, Gf.Vec3f(*fallback))
        return author(reader, "outputs:result", Types.Float3).path


def author_camera(layer: Sdf.Layer, axes: np.ndarray, eye: np.ndarray, distance: float) -> None:
    """A camera at ``eye`` that looks against VIEW; axes are right, up and out."""
    spec = define(layer, WORLD.AppendChild("camera"), "Camera")
    author(spec, "focalLength", Types.Float, FOCAL_LENGTH)
    author(spec, "horizontalAperture", Types.Float, float(APERTURE[0]))
    author(spec, "verticalAperture", Types.Float, float(APERTURE[1]))
    author(spec, "focusDistance", Types.Float, distance)
    # Far: what flies off, and the ends of planes.
    near_and_far = Gf.Vec2f(0.01 * distance, 100.0 * distance)
    author(spec, "clippingRange", Types.Float2, near_and_far)
    place(spec, pose_of(np.array(VIEW) @ axes, axes[1], eye))


def author_lights(layer: Sdf.Layer, axes: np.ndarray) -> None:
    """A light from above on the camera's side, and a sky that fills the shadows."""
    key = define(layer, WORLD.AppendPath("lights/key"), "DistantLight")
    author(key, "inputs:intensity", Types.Float, 1.0)
    author(key, "inputs:normalize", Types.Bool, True)  # brightness does not depend on the angle
    author(key, "inputs:angle", Types.Float, 2.0)
    place(key, pose_of(np.array([-0.6, 1.2, 0.8]) @ axes, axes[1], np.zeros(3)))
    sky = define(layer, WORLD.AppendPath("lights/sky"), "DomeLight")
    author(sky, "inputs:intensity", Types.Float, 0.5)
    # The default, but Blender's own grey sky stays where no colour is authored.
    author(sky, "inputs:color", Types.Color3f, Gf.Vec3f(1.0))
