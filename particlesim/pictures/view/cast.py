"""Who is drawn of a stage: its prims by world and group, those that change, and boundaries."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from ...output.usd.layout import is_boundary
from ..render.paint import Paint
from ..render.prims import READERS

WORLD = re.compile(r"/env_(\d+)/([^/]+)")
FIXED = (Usd.ResolveInfoSourceNone, Usd.ResolveInfoSourceFallback, Usd.ResolveInfoSourceDefault)
GAP = 0.2  # between worlds that are put side by side, in parts of the largest


@dataclass(frozen=True)
class Member:
    """A prim that is drawn.

    Args:
        path: Where it is on the stage.
        world: Number of its world; None: it belongs to all.
        group: Its name in the world; None for boundaries and outlines.
        layer: ``"thing"``, ``"boundary"``, or ``"plane"``, which has no end of its own.
        still: The same in every frame.
    """

    path: Sdf.Path
    world: int | None
    group: str | None
    layer: str
    still: bool


def cast(stage: Usd.Stage) -> list[Member]:
    """All prims that are drawn at some time."""
    members = []
    varying: dict[Sdf.Path, bool] = {}
    scanned = iter(Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies()))
    for prim in scanned:
        if prim.IsA(UsdGeom.PointInstancer):
            scanned.PruneChildren()  # its prototypes are no prims of their own
        if any(prim.IsA(kind) for kind, _ in READERS) and _shown(prim):
            members.append(_member(prim, varying))
    return members


def groups(stage: Usd.Stage, members: Sequence[Member]) -> list[dict[str, Any]]:
    """Names and linear colours of the groups, in order."""
    found: dict[str, Any] = {}
    for member in members:
        if member.group is not None and member.group not in found:
            prim = stage.GetPrimAtPath(member.path)
            found[member.group] = Paint().of(prim, Usd.TimeCode.EarliestTime(), 1)[0].tolist()
    return [{"name": name, "color": color} for name, color in found.items()]


def coinciding(stage: Usd.Stage, worlds: Sequence[int]) -> bool:
    """Whether there are several worlds, and none of them has been put anywhere."""
    if len(worlds) < 2:
        return False
    rooms = [stage.GetPrimAtPath(f"/World/env_{world:04d}") for world in worlds]
    return all(
        room.IsA(UsdGeom.Xformable) and not UsdGeom.Xformable(room).GetOrderedXformOps()
        for room in rooms
    )


def side_by_side(boxes: dict[int, np.ndarray], up: np.ndarray) -> dict[int, np.ndarray]:
    """Where worlds that are in one place go to be seen apart: rows on the ground, (3,) [length].

    Args:
        boxes: Lower and upper corner of every world, (2, 3) [length].
        up: (3,).
    """
    size = np.max([each[1] - each[0] for each in boxes.values()], axis=0)
    size = size + GAP * (float(size.max()) or 1.0)
    deep = 1 if up[2] > 0.5 else 2
    columns = int(np.ceil(np.sqrt(len(boxes))))
    shifts = {}
    for k, world in enumerate(boxes):
        cell = np.zeros(3)
        cell[0] = k % columns
        # Away from the camera, which looks along -z, or y.
        cell[deep] = k // columns * (1.0 if deep == 1 else -1.0)
        shifts[world] = cell * size
    return shifts


def _member(prim: Usd.Prim, varying: dict[Sdf.Path, bool]) -> Member:
    path = prim.GetPath()
    found = WORLD.search(str(path))
    layer = "thing"
    if is_boundary(prim):
        x = prim.GetAttribute("points").Get() if prim.HasAttribute("points") else None
        four = prim.IsA(UsdGeom.Mesh) and x is not None and len(x) == 4
        layer = "plane" if four else "boundary"
    outline = layer != "thing" or prim.GetName() == "periodic_box"
    name = found[2] if found else prim.GetName()
    return Member(
        path,
        int(found[1]) if found else None,
        None if outline else name,
        layer,
        not _varies(prim, varying),
    )


def _varies(prim: Usd.Prim, known: dict[Sdf.Path, bool]) -> bool:
    """Whether a prim, or what it is below, may change with time."""
    path = prim.GetPath()
    if path not in known:
        # Not whether values differ so far: of a recording that grows there may be one frame only.
        sources = (each.GetResolveInfo().GetSource() for each in prim.GetAuthoredAttributes())
        own = any(source not in FIXED for source in sources)
        parent = prim.GetParent()
        known[path] = own or (bool(parent) and _varies(parent, known))
    return known[path]


def _shown(prim: Usd.Prim) -> bool:
    purpose = UsdGeom.Imageable(prim).ComputePurpose()
    return purpose not in (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy)
