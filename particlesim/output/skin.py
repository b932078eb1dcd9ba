"""The triangles that groups are drawn as, less those that are torn."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from ..scene.group import Group


class Skin:
    """The triangles of a group of one world, and which constraints may break their sides.

    Args:
        group: With triangles.
        constraints: Those of the simulation, bound.
        w: Number of the world.
    """

    def __init__(self, group: Group, constraints: Iterable[Any], w: int):
        assert group.triangles is not None
        self.triangles = group.triangles
        self.sides: list[tuple[Any, np.ndarray]] = []  # (t, 3) rows of its ``broken``, or -1
        sides = np.sort(group.indices[self.triangles][:, [[0, 1], [1, 2], [2, 0]]], axis=2)
        for part in constraints:
            if getattr(part, "break_force", None) is None:
                continue
            first = sum(len(peer.links()) for peer in part.peers[:w])
            pairs = np.sort(part.peers[w].links(), axis=1).tolist()
            row = {tuple(pair): first + n for n, pair in enumerate(pairs)}
            rows = [[row.get(tuple(side), -1) for side in three] for three in sides.tolist()]
            if np.max(rows) >= 0:
                self.sides.append((part, np.array(rows)))

    def whole(self, broken: Mapping[Any, np.ndarray]) -> np.ndarray:
        """Triangles with all of their sides, (t, 3) within the group."""
        torn = np.zeros(len(self.triangles), dtype=bool)
        for part, rows in self.sides:
            torn |= np.append(broken[part], False)[rows].any(axis=1)
        return self.triangles[~torn]


def read_broken(constraints: Iterable[Any]) -> dict[Any, np.ndarray]:
    """What is broken now: one copy from the device a constraint, not one a world."""
    return {part: part.read_broken(part) for part in set(constraints)}
