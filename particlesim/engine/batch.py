"""Batches: scenes of one kind become the worlds of one simulation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .. import validate
from ..scene.scene import Scene


def scenes(given: Any, worlds: int | None) -> list[Scene]:
    """The scenes of a batch, checked to be of one kind."""
    owner = "Simulation"
    if isinstance(given, Scene):
        count = 1 if worlds is None else validate.whole(owner, "worlds", worlds, minimum=1)
        return [given] * count
    if not isinstance(given, Sequence) or not all(isinstance(each, Scene) for each in given):
        raise TypeError(f"{owner}: scene must be a Scene or a list of Scenes, got {given!r}; "
                        "build one with particlesim.Scene().")  # fmt: skip
    if worlds is not None:
        raise validate.fail(
            owner, "worlds", "be left out with a list of scenes", worlds, "each scene is a world"
        )
    if not given:
        raise validate.fail(owner, "scene", "hold at least one Scene", given, "add a scene")
    first = given[0]
    for w, other in enumerate(given):
        for what in ("interactions", "constraints"):
            ours = [part.kind() for part in getattr(first, what)]
            theirs = [part.kind() for part in getattr(other, what)]
            if ours != theirs:
                mine = [part.name for part in getattr(first, what)]
                names = [part.name for part in getattr(other, what)]
                raise validate.fail(
                    owner, f"scenes[{w}].{what}", f"be of the kinds of scenes[0] ({mine})", names,
                    "make a batch of scenes of one kind",
                )  # fmt: skip
        if [group.name for group in first.groups] != [group.name for group in other.groups]:
            raise validate.fail(
                owner, f"scenes[{w}].groups", "have the names of scenes[0]'s",
                [group.name for group in other.groups], "make a batch of scenes of one kind",
            )  # fmt: skip
    return list(given)


def bound(parts: Sequence[Sequence[Any]]) -> list[Any]:
    """One part for all worlds, from the corresponding ones of the scenes."""
    return [peers[0].bind(peers) for peers in zip(*parts, strict=True)]
