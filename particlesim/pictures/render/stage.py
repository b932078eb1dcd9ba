"""What a USD stage shows at a time code: its geometry, ground and camera."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from pxr import Usd, UsdGeom

from ...output.usd.layout import is_boundary
from ...output.usd.recording import PORTION, Recording, prims, up_axis
from ...output.usd.writing.geometry import posed
from .camera import Camera
from .geometry import Geometry
from .overview import Overview, middle
from .paint import Paint
from .prims import PrimReader

SUNK = 1e-3  # of what there is to see, that a ground is below clear floors
LEVEL = 1e-6  # off which a plane is not level


@dataclass(eq=False)
class View:
    """What there is to see of a stage at one time.

    Args:
        geometry: The shapes.
        up: The stage's up, (3,).
        floor: Height of the lowest boundary along up [length]; None where there is none.
        camera: The stage's own; None where it has none.
    """

    geometry: Geometry
    up: np.ndarray
    floor: float | None
    camera: Camera | None


def look_at(stage: Usd.Stage, frame: float, paint: Paint | None = None) -> View:
    """All that is visible at a frame.

    Plain level planes of boundaries are left out: they become the ground.

    Args:
        stage: The stage.
        frame: Its time code.
        paint: Colours; None: those of the stage.
    """
    time = Usd.TimeCode(frame)
    geometry = Geometry()
    reader = PrimReader(geometry, paint or Paint(), time)
    cache = UsdGeom.XformCache(time)
    up = up_axis(stage)
    heights: list[float] = []
    camera = None
    scanned = prims(stage)
    for prim in scanned:
        image = UsdGeom.Imageable(prim)
        if image and _hidden(image, time):
            scanned.PruneChildren()
            continue
        pose = np.asarray(cache.GetLocalToWorldTransform(prim))
        if prim.IsA(UsdGeom.Camera):
            camera = camera or _camera(prim, time, pose, up)
        elif not _is_ground(reader, prim, pose, up, heights):
            reader.add(prim, pose)
        if prim.IsA(UsdGeom.PointInstancer):
            scanned.PruneChildren()  # its prototypes are no prims of their own
    floor = min(heights, default=None)
    return View(geometry, up, None if floor is None else floor - _sunk(geometry), camera)


def overlook(
    recording: Recording, frames: Sequence[float], aspect: float, own: Camera | None
) -> Camera:
    """The camera of some frames: the own one if that sees the particles in each, or an overview."""
    framed = Overview(up_axis(recording.stage), aspect)
    for geometry in _geometries(recording, frames):
        framed.add(geometry)
        own = own if own is not None and framed.seen_by(own, geometry) else None
    return own or framed.camera()


def follow(
    recording: Recording, frames: Sequence[float], aspect: float, own: Camera | None
) -> list[Camera]:
    """A camera for each frame, which goes with the middle of the particles and does not turn.

    The first is the own one; or else all are as near as lets them see the particles in each.
    """
    framed = Overview(up_axis(recording.stage), aspect)
    middles = []
    for geometry in _geometries(recording, frames):
        middles.append(middle(geometry))
        framed.add_around(geometry, middles[-1])
    camera = framed.camera().moved(middles[0]) if own is None else own
    return [camera.moved(each - middles[0]) for each in middles]


def _geometries(recording: Recording, frames: Sequence[float]) -> Iterator[Geometry]:
    for number, frame in enumerate(frames):
        if number and number % PORTION == 0:  # a stage keeps all clips open that it has read
            recording = Recording("render", recording.path)
        yield look_at(recording.stage, frame).geometry


def _hidden(image: UsdGeom.Imageable, time: Usd.TimeCode) -> bool:
    """Not to be drawn, and what is below it neither."""
    if image.GetVisibilityAttr().Get(time) == UsdGeom.Tokens.invisible:
        return True
    return image.GetPurposeAttr().Get() in (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy)


def _is_ground(
    reader: PrimReader, prim: Usd.Prim, pose: np.ndarray, up: np.ndarray, heights: list[float]
) -> bool:
    """Note how low a boundary reaches; true for a plain level plane."""
    if not is_boundary(prim) or not prim.IsA(UsdGeom.Mesh):
        return False
    x = reader.array(prim, "points")
    if x is None:
        return False
    height = posed(x.astype(np.float64), pose) @ up
    heights.append(float(height.min()))
    opacity = reader.array(prim, "primvars:displayOpacity")
    solid = opacity is None or opacity.min() >= 1.0
    return len(x) == 4 and solid and float(np.ptp(height)) <= LEVEL * float(np.ptp(x))


def _sunk(geometry: Geometry) -> float:
    """How far a ground is below the floor, so that a clear floor is always in front of it."""
    box = geometry.box_of("ball", "cone")
    box = geometry.box if box is None else box
    return SUNK * float(np.linalg.norm(box[1] - box[0]))


def _camera(prim: Usd.Prim, time: Usd.TimeCode, pose: np.ndarray, up: np.ndarray) -> Camera | None:
    """The camera of a prim; None for one without perspective."""
    seen = UsdGeom.Camera(prim).GetCamera(time)
    if seen.projection != seen.Perspective or seen.focalLength <= 0:
        return None
    back = pose[2, :3] / np.linalg.norm(pose[2, :3])
    distance = seen.focusDistance or 1.0
    angle = 2.0 * math.degrees(math.atan(0.5 * seen.verticalAperture / seen.focalLength))
    return Camera(pose[3, :3], pose[3, :3] - distance * back, pose[1, :3], angle)
