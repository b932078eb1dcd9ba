"""Renderer: geometry to pictures, on the CPU and on CUDA alike."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...kernels.pictures import shade as render_shade
from ...kernels.pictures.light import Light
from . import look as looks
from .camera import Camera, view_axes
from .geometry import Geometry
from .image import Image
from .look import Look
from .screen import Crew, Screen, make_view, placed

SHADOW_SIZE = 1024  # samples along a side of the shadow map
OCCLUSION_SAMPLES = 8
LEAST = 0.71  # samples, half their diagonal: a sphere of this radius holds the middle of one
LARGEST = 16384  # samples along a side


class Renderer:
    """Makes pictures.

    The same geometry gives the same picture, bit for bit, on any number of threads: what a sample
    shows is the nearest shape, the first of equally near ones.

    Args:
        device: ``"cpu"``, ``"cuda:0"``, ...; None: CUDA where there is one, else the CPU.
        threads: Of the CPU; None: as many as there are cores.

    Example:
        >>> geometry = Geometry()
        >>> geometry.add_spheres([(0, 0, 0)], 1.0, (1.0, 0.0, 0.0))
        >>> camera = Camera((0, 0, 10), (0, 0, 0))
        >>> image = Renderer("cpu").draw(geometry, camera, 64, 36, Look(flat=True))
        >>> image.array[18, 32].tolist()
        [255, 0, 0]
    """

    def __init__(self, device: Any = None, threads: int | None = None):
        self.crew = Crew(device, threads)

    def draw(
        self,
        geometry: Geometry,
        camera: Camera,
        width: int = 1280,
        height: int = 720,
        look: Look | None = None,
    ) -> Image:
        """A picture of ``width`` x ``height`` pixels.

        Raises:
            ValueError: No pixels, or too many.
        """
        look = Look() if look is None else look
        for name, value in (("width", width), ("height", height)):
            validate.whole("Renderer.draw", name, value, minimum=1)
            if value * look.supersample > LARGEST:
                raise validate.fail(
                    "Renderer.draw", name, f"be at most {LARGEST // look.supersample} "
                    f"at {look.supersample} samples a pixel", value, "make it smaller",
                )  # fmt: skip
        return _Drawing(self.crew, geometry, camera, width, height, look).image()

    def close(self) -> None:
        """End the threads; they also end with the object."""
        self.crew.close()


@dataclass(frozen=True)
class _Bounds:
    """A sphere around the shapes."""

    center: np.ndarray
    radius: float


class _Drawing:
    """One picture in the making."""

    def __init__(
        self, crew: Crew, geometry: Geometry, camera: Camera, width: int, height: int, look: Look
    ):
        self.crew, self.look, self.step = crew, look, look.supersample
        self.size = (height, width)
        self.geometry = geometry
        self.bounds = _bounds(geometry)
        self.axes = camera.axes
        self.eye = camera.position
        reach = float(np.linalg.norm(self.eye - self.bounds.center)) + self.bounds.radius
        slope = (camera.slope * width / height, camera.slope)
        self.view = make_view(
            self.axes,
            self.eye,
            slope,
            width * self.step,
            height * self.step,
            near=1e-5 * reach,
            least=max(0.5 * self.step, LEAST),
        )
        bodies = {"ball": wp.vec4, "cone": wp.vec4, "corner": wp.vec3}
        self.bodies = {name: crew.array(geometry.array(name), bodies[name]) for name in bodies}
        cones = np.concatenate([geometry.array("cone"), geometry.array("wire")])
        self.solids = {**self.bodies, "cone": crew.array(cones, wp.vec4)}
        names = ("ball_color", "cone_color", "wire_color", "corner_color")
        colors = np.concatenate([geometry.array(name) for name in names])
        self.colors = crew.array(colors, wp.vec3)
        self.normals = crew.array(geometry.array("normal"), wp.vec3)

    def image(self) -> Image:
        crew, look = self.crew, self.look
        seen = Screen(crew, "camera", self.view, self.solids, self._ground())
        sun = self._sun()
        light = self._light(sun)
        pixels = self.size[0] * self.size[1]
        open_sky = crew.kept("sky", self.size, wp.float32)
        normal = wp.vec3(*(self.axes @ look.up))
        if look.occlusion and not look.flat:
            crew.launch(
                render_shade.find_occlusion, pixels,
                [self.view, seen.shapes, light, self.normals, self.colors, normal,
                 crew.array(_spirals(), wp.vec2), self.step, seen.depth, seen.shape, open_sky],
            )  # fmt: skip
        color = crew.kept("color", self.size, wp.vec3)
        crew.launch(
            render_shade.shade_pixels, pixels,
            [self.view, sun.view, seen.shapes, light, self.normals, self.colors, normal,
             self.step, seen.depth, seen.shape, sun.depth, open_sky, color],
        )  # fmt: skip
        self._veil(light, seen, color)
        encoded = crew.empty((*self.size, 3), wp.uint8)
        crew.launch(render_shade.encode_pixels, pixels, [color, encoded])
        return Image(encoded.numpy())

    def _ground(self) -> tuple[np.ndarray, float] | None:
        """The ground's normal in the camera's space, and the camera's height above it."""
        if self.look.ground is None:
            return None
        up = self.look.up
        return self.axes @ up, float(np.dot(up, self.eye)) - self.look.ground

    def _sun(self) -> Screen:
        """What the key light sees: the shadow map."""
        size = SHADOW_SIZE if self.look.shadows and not self.look.flat else 1
        back = self.look.key_direction(self.axes)
        helper = np.eye(3)[np.argmin(np.abs(back))]
        half = self.bounds.radius * (1.0 + 4.0 / size)
        view = make_view(
            view_axes(back, helper), self.bounds.center + 2.0 * half * back, (half, half),
            size, size, near=0.0, parallel=True,
        )  # fmt: skip
        return Screen(self.crew, "sun", view, self.bodies if size > 1 else _nothing(self.crew))

    def _light(self, sun: Screen) -> Any:
        look, bounds = self.look, self.bounds
        light = Light()
        light.flat, light.shadows, light.occlusion = look.flat, look.shadows, look.occlusion
        light.key_direction = wp.vec3(*(self.axes @ look.key_direction(self.axes)))
        light.up = wp.vec3(*(self.axes @ look.up))
        light.key, light.sky = wp.vec3(*looks.KEY), wp.vec3(*looks.SKY)
        light.bounce, light.ground = wp.vec3(*looks.BOUNCE), wp.vec3(*looks.GROUND)
        light.gloss, light.background = look.gloss, wp.vec3(*look.background)
        light.texel = 2.0 * sun.view.slope[0] / sun.view.width
        light.reach = _reach(self.geometry, bounds.radius)
        light.center = wp.vec3(*(self.axes @ (bounds.center - self.eye)))
        light.outside = bounds.radius + light.reach
        light.fade = 4.0 * bounds.radius
        return light

    def _veil(self, light: Any, seen: Screen, color: wp.array) -> None:
        """Draw the clear triangles over what is behind them."""
        crew, geometry = self.crew, self.geometry
        corners = geometry.array("veil")
        if not len(corners):
            return
        none = crew.empty(0, wp.vec4)
        shapes, lists = placed(crew, self.view, none, none, crew.array(corners, wp.vec3))
        start, listed = lists.whole()
        crew.launch(
            render_shade.veil_pixels, self.size[0] * self.size[1],
            [self.view, light, shapes.corner, crew.array(geometry.array("veil_color"), wp.vec3),
             crew.array(geometry.array("veil_opacity"), wp.float32), start, listed,
             self.step, seen.depth, color],
        )  # fmt: skip


def _bounds(geometry: Geometry) -> _Bounds:
    """A sphere around the solid shapes; huge plates count as far as the rest reaches."""
    box = geometry.box_of("ball", "cone")
    if box is None:
        box = geometry.box_of("wire", "corner", "veil")
    if box is None:
        return _Bounds(np.zeros(3), 1.0)
    radius = 0.5 * float(np.linalg.norm(box[1] - box[0]))
    return _Bounds(box.mean(axis=0), radius or 1.0)


def _nothing(crew: Crew) -> dict[str, wp.array]:
    """No solid shapes."""
    kinds = {"ball": wp.vec4, "cone": wp.vec4, "corner": wp.vec3}
    return {name: crew.empty(0, kind) for name, kind in kinds.items()}


def _spirals() -> np.ndarray:
    """Places spread evenly over the unit disk, in 16 turns, (16, n, 2) float32."""
    k = np.arange(OCCLUSION_SAMPLES)
    turns = np.arange(16)[:, None] * (np.pi / 8.0)
    radius, angle = np.sqrt((k + 0.5) / len(k)), k * np.pi * (3.0 - np.sqrt(5.0)) + turns
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1).astype(np.float32)


def _reach(geometry: Geometry, size: float) -> float:
    """How far off things close a place in: some particles away, and a sensible part of all."""
    radii = geometry.array("ball")[:, 3]
    usual = 4.0 * float(radii.mean()) if len(radii) else 0.1 * size
    return float(np.clip(usual, 0.02 * size, 0.15 * size))
