"""Where the parts of a recording are: its prims, and the files of its value clips.

Beside ``out.usda`` there are ``out.clips/manifest.usda``, which declares what clips hold, and
``out.clips/f.######.usdc``, a frame each.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Sdf, Tf, Usd

from .description import StageInfo

WORLD = Sdf.Path("/World")
BOUNDARIES, PERIODIC_BOX = "boundaries", "periodic_box"
# Names that a world's room has for other things than its groups.
RESERVED = (BOUNDARIES, PERIODIC_BOX)
MANIFEST = "manifest.usda"


@dataclass(frozen=True)
class Layout:
    """Prim paths, in the order of the description."""

    points: list[Sdf.Path]
    links: list[Sdf.Path]
    meshes: list[Sdf.Path]
    shapes: list[Sdf.Path]


def room(world: int) -> Sdf.Path:
    """The prim of a world."""
    return WORLD.AppendChild(f"env_{world:04d}")


def layout(info: StageInfo) -> Layout:
    """Where every prim goes: names made valid, and unique within their world."""
    taken: set[Sdf.Path] = set()

    def place(world: int, name: str, below: str = "") -> Sdf.Path:
        taken.update(room(world).AppendChild(name) for name in RESERVED)
        parent = room(world).AppendChild(below) if below else room(world)
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
        [place(prim.world, prim.name) for prim in info.meshes],
        [place(shape.world, shape.name, BOUNDARIES) for shape in info.shapes],
    )


def outlines(info: StageInfo) -> list[Sdf.Path]:
    """Paths of the outlines of the periodic box: one, or one a world where they are laid out."""
    places = [room(world) for world in info.worlds] if info.layout else [WORLD]
    return [place.AppendChild(PERIODIC_BOX) for place in places]


def is_boundary(prim: Usd.Prim) -> bool:
    """Whether a prim is what a recording draws of a boundary."""
    return f"/{BOUNDARIES}/" in str(prim.GetPath())


def is_outline(prim: Usd.Prim) -> bool:
    """Whether curves show where a boundary or a periodic box is."""
    return prim.GetName() == PERIODIC_BOX or is_boundary(prim)


# Value clips -----------------------------------------------------------------------------------


def clip_folder(root: Path) -> Path:
    """Where the clips of a recording are."""
    return root.with_suffix(".clips")


def clip_file(folder: Path, frame: int) -> Path:
    """The file of a frame."""
    return folder / f"f.{frame:06d}.usdc"


def stale_files(folder: Path) -> list[Path]:
    """The files of an earlier recording, and what a kill left of them."""
    return [*folder.glob("f.*.usdc"), *folder.glob("manifest.*usda")]


def set_frames(root: Sdf.Layer, folder: str, first: int, last: int) -> None:
    """Tell the root its first and last frame, and where the clips of them are."""
    root.startTimeCode, root.endTimeCode = first, last
    clip_set = {
        "primPath": str(WORLD),
        "manifestAssetPath": Sdf.AssetPath(f"./{folder}/{MANIFEST}"),
        "templateAssetPath": f"./{folder}/f.######.usdc",
        "templateStartTime": float(first),
        "templateEndTime": float(last),
        "templateStride": 1.0,
    }
    root.GetPrimAtPath(WORLD).SetInfo("clips", {"default": clip_set})


@dataclass(frozen=True)
class Clip:
    """One file of a clip set: what it holds is seen from stage time ``frame`` to ``until``.

    ``time`` is the time code inside the file.
    """

    frame: float
    until: float
    time: float
    path: Path

    @property
    def exists(self) -> bool:
        """Whether its file is there."""
        return self.path.is_file()


@dataclass(frozen=True)
class ClipSet:
    """The value clips of one prim; ``inside`` is the path that its prim has in the clip files."""

    prim: Sdf.Path
    inside: Sdf.Path
    manifest: Path | None
    clips: tuple[Clip, ...]

    def outside(self, path: Sdf.Path) -> Sdf.Path:
        """Path on the stage of what has ``path`` in a clip."""
        return path.ReplacePrefix(self.inside, self.prim)

    def declared(self, layer: Sdf.Layer) -> set[Sdf.Path]:
        """Paths of the attributes of a layer that belong to the set."""
        found: set[Sdf.Path] = set()

        def note(path: Sdf.Path) -> None:
            if path.IsPropertyPath() and layer.GetAttributeAtPath(path):
                found.add(path)

        if layer.GetPrimAtPath(self.inside):
            layer.Traverse(self.inside, note)
        return found


def opened(path: Path) -> Sdf.Layer | None:
    """The layer of a file; None: it cannot be read."""
    try:
        return Sdf.Layer.FindOrOpen(str(path))
    except Tf.ErrorException:
        return None


def clip_sets(prims: Iterator[Usd.Prim]) -> list[ClipSet]:
    """All clip sets of these prims."""
    found = []
    for prim in prims:
        if not prim.HasAuthoredMetadata("clips"):
            continue
        layer = next(spec.layer for spec in prim.GetPrimStack() if spec.HasInfo("clips"))
        for described in Usd.ClipsAPI(prim).GetClips().values():
            if isinstance(described, dict):
                manifest = described.get("manifestAssetPath")
                found.append(
                    ClipSet(
                        prim.GetPath(),
                        Sdf.Path(described.get("primPath", str(prim.GetPath()))),
                        _anchored(layer, manifest.path) if manifest and manifest.path else None,
                        tuple(_templated(layer, described) or _listed(layer, described)),
                    )
                )
    return found


def _anchored(layer: Sdf.Layer, path: str) -> Path:
    return Path(layer.ComputeAbsolutePath(path))


def _templated(layer: Sdf.Layer, described: dict[str, Any]) -> list[Clip]:
    """Clips named by number: one a stride, from start to end."""
    pattern = described.get("templateAssetPath", "")
    start, end, stride = (
        float(described.get(f"template{name}", 0.0)) for name in ("StartTime", "EndTime", "Stride")
    )
    digits = re.search(r"(#+)(?:\.(#+))?(?!.*#)", pattern)
    if digits is None or stride <= 0:
        return []
    clips = []
    for frame in start + stride * np.arange(int((end - start) / stride + 1e-6) + 1):
        number = f"{int(frame):0{len(digits[1])}d}"
        if digits[2]:
            number = f"{frame:0{len(digits[1]) + 1 + len(digits[2])}.{len(digits[2])}f}"
        name = pattern[: digits.start()] + number + pattern[digits.end() :]
        clips.append(Clip(frame, frame + stride, frame, _anchored(layer, name)))
    return clips


def _listed(layer: Sdf.Layer, described: dict[str, Any]) -> list[Clip]:
    """Clips that are named one by one."""
    paths = [_anchored(layer, asset.path) for asset in described.get("assetPaths", ())]
    active = sorted((float(t), int(k)) for t, k in described.get("active", ()))
    times = np.array(described.get("times", ()), dtype=float).reshape(-1, 2)
    starts = [t for t, _ in active] + [float("inf")]
    return [
        Clip(
            frame,
            until,
            float(np.interp(frame, times[:, 0], times[:, 1])) if len(times) else frame,
            paths[k],
        )
        for (frame, k), until in zip(active, starts[1:], strict=True)
        if 0 <= k < len(paths)
    ]
