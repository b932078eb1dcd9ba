"""Where the prims of a recording are."""

from __future__ import annotations

from dataclasses import dataclass

from pxr import Sdf, Tf, Usd

from .description import StageInfo

WORLD = Sdf.Path("/World")
BOUNDARIES, PERIODIC_BOX = "boundaries", "periodic_box"
# Names that a world's room has for other things than its groups.
RESERVED = (BOUNDARIES, PERIODIC_BOX)


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


def is_boundary(prim: Usd.Prim) -> bool:
    """Whether a prim is what a recording draws of a boundary."""
    return f"/{BOUNDARIES}/" in str(prim.GetPath())


def is_outline(prim: Usd.Prim) -> bool:
    """Whether curves show where a boundary or a periodic box is."""
    return prim.GetName() == PERIODIC_BOX or is_boundary(prim)
