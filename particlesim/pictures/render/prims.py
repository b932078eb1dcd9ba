"""USD prims as geometry: points, instances, meshes, curves and simple shapes at a time code."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from ...output.usd.layout import is_outline
from ...output.usd.writing.geometry import CORNERS, FACES, posed
from .geometry import Geometry
from .paint import Paint, authored

THIN = 0.005  # diameter of points without a width, in parts of the diagonal
ROUND = 1e-3  # part of its radius that a mesh may be off the sphere that it is taken for
AXES = {"X": 0, "Y": 1, "Z": 2}


class PrimReader:
    """Adds prims to a geometry.

    Args:
        geometry: Where to.
        paint: Their colours.
        time: When.
    """

    def __init__(self, geometry: Geometry, paint: Paint, time: Usd.TimeCode):
        self.geometry, self.paint, self.time = geometry, paint, time

    def add(self, prim: Usd.Prim, pose: np.ndarray) -> None:
        """Add one prim, if it is something to draw; a point in a row times ``pose`` (4, 4)."""
        for kind, read in READERS:
            if prim.IsA(kind):
                read(self, prim, pose)
                return

    def get(self, prim: Usd.Prim, name: str, default: Any = None) -> Any:
        """An attribute's value."""
        value = prim.GetAttribute(name).Get(self.time)
        return default if value is None else value

    def array(self, prim: Usd.Prim, name: str) -> np.ndarray | None:
        """An attribute's value as an array; None if there is none, or none in it."""
        value = self.get(prim, name)
        return None if value is None or not len(value) else np.asarray(value)

    def points(self, prim: Usd.Prim, pose: np.ndarray) -> None:
        x = self.array(prim, "points")
        if x is None:
            return
        width = self._each(self.array(prim, "widths"), len(x))
        if width is None:
            width = THIN * (float(np.linalg.norm(np.ptp(x, axis=0))) or 1.0)
        color = self.paint.of(prim, self.time, len(x))
        self.geometry.add_spheres(posed(x, pose), 0.5 * width * scale(pose), one(color))

    def curves(self, prim: Usd.Prim, pose: np.ndarray) -> None:
        """Curves through their points by straight pieces; other bases by their control polygon."""
        x, counts = self.array(prim, "points"), self.array(prim, "curveVertexCounts")
        if x is None or counts is None or counts.sum() != len(x):
            return
        start, end = _segments(counts, self.get(prim, "wrap") == UsdGeom.Tokens.periodic)
        given = self.array(prim, "widths")
        width = self._each(given, len(x))
        if width is None:
            width = THIN * (float(np.linalg.norm(np.ptp(x, axis=0))) or 1.0)
        radius = 0.5 * scale(pose) * np.broadcast_to(width, len(x))
        color = self.paint.of(prim, self.time, len(x))
        if len(color) == len(x) > 1:
            color = np.stack([color[start], color[end]], axis=1)
        at = posed(x, pose)
        radii = np.stack([radius[start], radius[end]], axis=1)
        self.geometry.add_cones(at[start], at[end], radii, one(color), not is_outline(prim))

    def mesh(self, prim: Usd.Prim, pose: np.ndarray) -> None:
        x, corners = self.array(prim, "points"), self.array(prim, "faceVertexIndices")
        counts = self.array(prim, "faceVertexCounts")
        if x is None or corners is None or counts is None or counts.sum() != len(corners):
            return
        fan, face = _fans(counts)  # into the corners
        each = {
            "vertex": corners[fan],
            "varying": corners[fan],
            "faceVarying": fan,
            "uniform": face,
        }
        color = self.paint.valued(prim, self.time, len(x))
        index = each["vertex"]
        if color is None:
            color, kind = authored(prim, self.time)
            index = each.get(kind, np.zeros(len(fan), dtype=int))
        color = color[index] if len(color) > index.max(initial=0) else color[:1]
        self._triangles(prim, pose, x, corners[fan], one(color), self._normals(prim, corners, fan))

    def instancer(self, prim: Usd.Prim, pose: np.ndarray) -> None:
        """Copies of each prototype; spheres, and meshes that are as good as spheres, as such."""
        instancer = UsdGeom.PointInstancer(prim)
        which = self.array(prim, "protoIndices")
        poses = instancer.ComputeInstanceTransformsAtTime(
            self.time, self.time, UsdGeom.PointInstancer.IncludeProtoXform
        )
        if which is None or not len(poses):
            return
        matrices = np.asarray(poses, dtype=np.float64).reshape(-1, 4, 4) @ pose
        which = which[: len(matrices)]
        colors = self.paint.of(prim, self.time, len(matrices))
        for k, path in enumerate(instancer.GetPrototypesRel().GetTargets()):
            mine = np.flatnonzero(which == k)
            root = prim.GetStage().GetPrimAtPath(path)
            if len(mine) and root:
                own = colors[mine] if len(colors) == len(matrices) > 1 else None
                self._copies(root, matrices[mine], own)

    def _copies(self, root: Usd.Prim, matrices: np.ndarray, colors: np.ndarray | None) -> None:
        cache = UsdGeom.XformCache(self.time)
        back = np.linalg.inv(np.asarray(cache.GetLocalToWorldTransform(root)))
        for prim in Usd.PrimRange(root):
            inside = np.asarray(cache.GetLocalToWorldTransform(prim)) @ back
            ball = self._ball(prim)
            if ball is not None:
                all_poses = inside @ matrices
                center = np.concatenate([ball[0], [1.0]]) @ all_poses
                radius = ball[1] * np.abs(np.linalg.det(all_poses[:, :3, :3])) ** (1 / 3)
                color = authored(prim, self.time)[0][0] if colors is None else colors
                self.geometry.add_spheres(center[:, :3], radius, color)
                continue
            for matrix in matrices:
                self.add(prim, inside @ matrix)

    def _ball(self, prim: Usd.Prim) -> tuple[np.ndarray, float] | None:
        """Center and radius of what is a sphere, in its own space."""
        if prim.IsA(UsdGeom.Sphere):
            return np.zeros(3), float(self.get(prim, "radius"))
        x = self.array(prim, "points") if prim.IsA(UsdGeom.Mesh) else None
        if x is None or len(x) < 12:
            return None
        center = 0.5 * (x.min(axis=0) + x.max(axis=0)).astype(np.float64)
        distance = np.linalg.norm(x - center, axis=1)
        radius = float(distance.mean())
        return (center, radius) if np.ptp(distance) < ROUND * radius else None

    def sphere(self, prim: Usd.Prim, pose: np.ndarray) -> None:
        radius = float(self.get(prim, "radius")) * scale(pose)
        color = one(self.paint.of(prim, self.time, 1))
        self.geometry.add_spheres(posed(np.zeros((1, 3)), pose), radius, color)

    def cube(self, prim: Usd.Prim, pose: np.ndarray) -> None:
        x = (CORNERS - 0.5) * float(self.get(prim, "size"))
        self._triangles(prim, pose, x, FACES[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3))

    def plane(self, prim: Usd.Prim, pose: np.ndarray) -> None:
        u = np.array([-0.5, 0.5, 0.5, -0.5]) * float(self.get(prim, "width"))
        v = np.array([-0.5, -0.5, 0.5, 0.5]) * float(self.get(prim, "length"))
        # Along x the plane is as wide as z and as long as y; along y, as z; along z, as y (USD).
        x = np.zeros((4, 3))
        wide, long = {"X": (2, 1), "Y": (0, 2), "Z": (0, 1)}[self.get(prim, "axis", "Z")]
        x[:, wide], x[:, long] = u, v
        self._triangles(prim, pose, x, np.array([[0, 1, 2], [0, 2, 3]]))

    def capsule(self, prim: Usd.Prim, pose: np.ndarray) -> None:
        half = np.zeros((1, 3))
        half[0, AXES[self.get(prim, "axis", "Z")]] = 0.5 * float(self.get(prim, "height"))
        radius = float(self.get(prim, "radius")) * scale(pose)
        color = one(self.paint.of(prim, self.time, 1))
        self.geometry.add_cones(posed(-half, pose), posed(half, pose), radius, color)

    def _triangles(
        self,
        prim: Usd.Prim,
        pose: np.ndarray,
        x: np.ndarray,
        index: np.ndarray,
        color: np.ndarray | None = None,
        normals: np.ndarray | None = None,
    ) -> None:
        if color is None:
            color = one(self.paint.of(prim, self.time, 1))
        if normals is not None:
            normals = normals @ np.linalg.inv(pose[:3, :3]).T
        opacity = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance("displayOpacity")
        given = opacity.ComputeFlattened(self.time) if opacity else None
        solid = float(np.mean(given)) if given is not None and len(given) else 1.0
        if solid < 1.0 and color.ndim == 3:
            color = color.mean(axis=1)
        self.geometry.add_triangles(posed(x, pose), index, color, normals, solid)

    def _normals(self, prim: Usd.Prim, corners: np.ndarray, fan: np.ndarray) -> np.ndarray | None:
        """Authored normals at the triangles' corners, (t, 3, 3); None: flat faces."""
        found = self.array(prim, "normals")
        if found is None:
            return None
        kind = UsdGeom.Mesh(prim).GetNormalsInterpolation()
        index = {"vertex": corners[fan], "varying": corners[fan], "faceVarying": fan}.get(kind)
        if index is None or len(found) <= index.max(initial=0):
            return None
        return found[index].astype(np.float64)

    @staticmethod
    def _each(values: np.ndarray | None, count: int) -> Any:
        """One value for all, or one each; None of another count."""
        if values is None or len(values) not in (1, count):
            return None
        return float(values[0]) if len(values) == 1 else values


# Most particular first.
READERS: list[tuple[Any, Callable[[PrimReader, Usd.Prim, np.ndarray], None]]] = [
    (UsdGeom.Points, PrimReader.points),
    (UsdGeom.PointInstancer, PrimReader.instancer),
    (UsdGeom.Mesh, PrimReader.mesh),
    (UsdGeom.BasisCurves, PrimReader.curves),
    (UsdGeom.Sphere, PrimReader.sphere),
    (UsdGeom.Cube, PrimReader.cube),
    (UsdGeom.Plane, PrimReader.plane),
    (UsdGeom.Capsule, PrimReader.capsule),
]


def scale(pose: np.ndarray) -> float:
    """How much longer lengths become, in the mean."""
    return float(np.abs(np.linalg.det(pose[:3, :3])) ** (1 / 3))


def one(colors: np.ndarray) -> np.ndarray:
    """A single colour as (3,)."""
    return colors[0] if colors.ndim == 2 and len(colors) == 1 else colors


def _segments(counts: np.ndarray, closed: bool) -> tuple[np.ndarray, np.ndarray]:
    """First and second point of each piece of curves with so many points each."""
    last = np.cumsum(counts) - 1
    start = np.delete(np.arange(counts.sum()), last)
    end = start + 1
    if closed:
        start = np.concatenate([start, last])
        end = np.concatenate([end, last + 1 - counts])
    return start, end


def _fans(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles of faces with so many corners, (t, 3) into the corners, and the face of each."""
    pieces = np.maximum(counts - 2, 0)
    face = np.repeat(np.arange(len(counts)), pieces)
    first = (np.cumsum(counts) - counts)[face]
    k = np.arange(len(face)) - (np.cumsum(pieces) - pieces)[face]
    return np.stack([first, first + k + 1, first + k + 2], axis=1), face
