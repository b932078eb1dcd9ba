"""Geometry of a recording's stage: what it spans, where the camera stands, and simple shapes."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from pxr import Gf

from ..description import Shape, StageInfo
from .frame import Frame

FOCAL_LENGTH = 35.0
APERTURE = np.array([36.0, 20.25])  # 16:9, in the units of the focal length
VIEW = (0.35, 0.35, 1.0)  # from the scene to the camera: right, up, out
# The corners of the unit box in counting order, its edges, and its faces seen from outside.
CORNERS = np.array([[k >> 2 & 1, k >> 1 & 1, k & 1] for k in range(8)], dtype=np.float64)
EDGES = [(a, a | bit) for bit in (1, 2, 4) for a in range(8) if not a & bit]
FACES = np.array(
    [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
)


def extent(points: np.ndarray, width: np.ndarray | float | None) -> np.ndarray:
    """Lower and upper corner of (n, 3) points with diameters, (n,), one or none; (2, 3).

    Of no points it is USD's own empty range, whose lower corner is above the upper.
    """
    if not len(points):
        largest = np.finfo(np.float32).max
        return np.array([[largest] * 3, [-largest] * 3], dtype=np.float32)
    half = np.float32(0.5) * np.asarray(0.0 if width is None else width, dtype=np.float32)
    # Column by column: a reduction of (n, 3) over its rows takes ten times as long.
    columns = [points[:, k] for k in range(3)]
    lower = [(x - half).min() if half.ndim else x.min() - half for x in columns]
    upper = [(x + half).max() if half.ndim else x.max() + half for x in columns]
    return np.array([lower, upper], dtype=np.float32)


def world_boxes(info: StageInfo, frame: Frame) -> dict[int, np.ndarray]:
    """Corners of what there is to see of each world, in its own space: (2, 3) each.

    Particles, surfaces, boundaries, and planes that are near.
    """
    boxes: dict[int, list[np.ndarray]] = {world: [] for world in info.worlds}
    for prim, (rows, _) in zip(info.points, frame.clouds, strict=True):
        boxes[prim.world].append(extent(frame.x[rows], frame.widths(prim, rows)))
    for mesh, surface in zip(info.meshes, frame.surfaces, strict=True):
        boxes[mesh.world].append(extent(surface.points, None))
    for shape, pose in zip(info.shapes, frame.poses, strict=True):
        if shape.kind != "plane":
            boxes[shape.world].append(extent(posed(shape_corners(shape), pose), None))
    if info.periodic is not None:
        for own in boxes.values():
            own.append(np.where(np.isnan(info.periodic), joined(own), info.periodic))
    result = {world: joined(own) for world, own in boxes.items()}
    for shape, pose in zip(info.shapes, frame.poses, strict=True):
        if shape.kind == "plane":
            result[shape.world] = _with_plane(result[shape.world], *posed_plane(shape, pose))
    return result


def joined(boxes: Iterable[np.ndarray]) -> np.ndarray:
    """The box around boxes (2, 3); the unit box around the origin where all are empty."""
    full = [np.asarray(box, dtype=np.float64) for box in boxes if np.all(box[0] <= box[1])]
    if not full:
        return np.array([[-0.5] * 3, [0.5] * 3])
    return np.array([np.min(full, axis=(0, 1)), np.max(full, axis=(0, 1))])


def _with_plane(box: np.ndarray, point: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """The box and the foot of its middle on a plane, if that is near."""
    center = box.mean(axis=0)
    foot = foot_of(center, point, normal)
    if np.linalg.norm(foot - center) > 2.0 * np.linalg.norm(box[1] - box[0]):
        return box
    return np.array([np.minimum(box[0], foot), np.maximum(box[1], foot)])


def shape_corners(shape: Shape) -> np.ndarray:
    """Points that a shape, other than a plane, is between; (n, 3)."""
    first, second = shape.parameters
    if shape.kind == "mesh":
        return first
    lower, upper = (first - second, first + second) if shape.kind == "sphere" else (first, second)
    return lower + CORNERS * (upper - lower)


def posed(points: np.ndarray, pose: np.ndarray | None) -> np.ndarray:
    """Points (n, 3) in rows times a pose (4, 4), if there is one that moves them."""
    if pose is None or np.array_equal(pose, np.eye(4)):
        return points
    return points @ pose[:3, :3] + pose[3, :3]


def posed_plane(shape: Shape, pose: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Point and normal of a plane where its pose puts it."""
    point, normal = shape.parameters
    return posed(point[None], pose)[0], normal if pose is None else normal @ pose[:3, :3]


def foot_of(at: np.ndarray, point: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """The point of a plane that is nearest to ``at``."""
    return at - normal * np.dot(normal, at - point) / np.dot(normal, normal)


def square_on(box: np.ndarray, point: np.ndarray, normal: np.ndarray, half: float) -> np.ndarray:
    """Corners of a square of a plane under the middle of a box, facing its normal, (4, 3)."""
    n = normal / np.linalg.norm(normal)
    u = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    u *= half / np.linalg.norm(u)
    v = np.cross(n, u)
    return foot_of(box.mean(axis=0), point, normal) + np.array([-u - v, u - v, u + v, v - u])


def unit_sphere(cuts: int) -> tuple[np.ndarray, np.ndarray]:
    """Points of the unit sphere (n, 3) and quads (m, 4): a cube with cut faces, blown up."""
    steps = np.tan(np.linspace(-0.25 * np.pi, 0.25 * np.pi, cuts + 1))  # cuts at equal angles
    patches = []
    for a, b, _, d in (2.0 * CORNERS - 1.0)[FACES]:
        u, v = (b - a) / 2.0, (d - a) / 2.0
        patches.append(a + u + v + steps[:, None, None] * u + steps[None, :, None] * v)
    cube = np.reshape(patches, (-1, 3))
    index = np.arange(len(cube)).reshape(6, cuts + 1, cuts + 1)
    quads = [index[:, :-1, :-1], index[:, 1:, :-1], index[:, 1:, 1:], index[:, :-1, 1:]]
    return cube / np.linalg.norm(cube, axis=1)[:, None], np.stack(quads, axis=-1).reshape(-1, 4)


def viewpoint(box: np.ndarray, axes: np.ndarray, size: float) -> tuple[np.ndarray, float]:
    """Where the camera sees all of a box, and how far that is from its middle."""
    center = box.mean(axis=0)
    right, up, back = view_frame(np.array(VIEW) @ axes, axes[1])
    corners = box[0] + CORNERS * (box[1] - box[0]) - center
    slope = 0.5 * APERTURE / FOCAL_LENGTH
    needed = np.abs(corners @ np.array([right, up]).T) / slope + (corners @ back)[:, None]
    distance = max(1.1 * float(needed.max()), size)
    return center + distance * back, distance


def view_frame(back: np.ndarray, up: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Right, up and back of what looks against ``back``, orthonormal."""
    back = back / np.linalg.norm(back)
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    return right, np.cross(back, right), back


def pose_of(back: np.ndarray, up: np.ndarray, at: np.ndarray) -> Gf.Matrix4d:
    """Transform of a camera or light, which look along their -z; USD's vectors are rows."""
    matrix = np.eye(4)
    matrix[:3, :3] = view_frame(back, up)
    matrix[3, :3] = at
    return Gf.Matrix4d(*matrix.ravel().tolist())
