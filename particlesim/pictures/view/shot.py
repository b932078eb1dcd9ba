"""A shot: what of a stage is seen at one time, in layers, and the edges of its boundaries."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from pxr import Usd, UsdGeom

from ...output.usd.writing.geometry import posed
from ..render.geometry import Geometry
from ..render.paint import Paint
from ..render.prims import PrimReader
from .cast import Member

LAYERS = ("thing", "boundary", "plane")
SHAPES = ("ball", "cone", "wire", "corner", "veil")


class Shot:
    """Prims at one time, in layers.

    Args:
        stage: The stage.
        frame: The time code.
        paint: The colours.
    """

    def __init__(self, stage: Usd.Stage, frame: float, paint: Paint):
        self.stage, self.time = stage, Usd.TimeCode(frame)
        self.layers = {name: Geometry() for name in LAYERS}
        self._readers = {
            name: PrimReader(layer, paint, self.time) for name, layer in self.layers.items()
        }
        self._poses = UsdGeom.XformCache(self.time)
        self._edges: list[np.ndarray] = []

    def add(self, member: Member, shift: np.ndarray | None) -> None:
        """Add a prim, shifted by (3,) [length]."""
        prim = self.stage.GetPrimAtPath(member.path)
        if UsdGeom.Imageable(prim).ComputeVisibility(self.time) == UsdGeom.Tokens.invisible:
            return
        pose = np.array(self._poses.GetLocalToWorldTransform(prim))
        if shift is not None:
            pose[3, :3] += shift
        self._readers[member.layer].add(prim, pose)
        if member.layer != "thing":
            self._edges.append(_edges(prim, pose, self.time))

    def edges(self) -> np.ndarray:
        """Ends of the edges of boundaries, (m, 2, 3) [length]."""
        return np.concatenate(self._edges) if self._edges else np.zeros((0, 2, 3))

    @property
    def box(self) -> np.ndarray | None:
        """Lower and upper corner of all but planes, (2, 3) [length]."""
        found = [self.layers[name].box_of(*SHAPES) for name in ("thing", "boundary")]
        return joined(box for box in found if box is not None and np.isfinite(box).all())


def joined(boxes: Iterable[np.ndarray]) -> np.ndarray | None:
    """The box around boxes, (2, 3); None of none."""
    corners = np.array(list(boxes))
    if not len(corners):
        return None
    return np.array([corners[:, 0].min(axis=0), corners[:, 1].max(axis=0)])


def _edges(prim: Usd.Prim, pose: np.ndarray, time: Usd.TimeCode) -> np.ndarray:
    """Ends of the edges of a mesh's faces, each edge once, (m, 2, 3) [length]."""
    names = ("points", "faceVertexCounts", "faceVertexIndices")
    found = [prim.GetAttribute(name).Get(time) for name in names]
    if not prim.IsA(UsdGeom.Mesh) or any(each is None or not len(each) for each in found):
        return np.zeros((0, 2, 3))
    x, counts, corners = (np.asarray(each) for each in found)
    ends = np.cumsum(counts)
    if ends[-1] != len(corners):
        return np.zeros((0, 2, 3))
    following = np.arange(1, len(corners) + 1)
    following[ends[counts > 0] - 1] = (ends - counts)[counts > 0]
    pairs = np.sort(np.stack([corners, corners[following]], axis=1), axis=1)
    return posed(x, pose)[np.unique(pairs, axis=0)]
