"""What is drawn of constraints that break: links, and triangles between them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .description import LinksPrim, MeshPrim


@dataclass(frozen=True, eq=False)
class Breakable:
    """Links of a constraint that may break, of one world."""

    prim: LinksPrim
    constraint: Any  # bound
    rows: slice  # of its ``broken``
    pairs: np.ndarray  # (m, 2), rows of the simulation's arrays
    drawn: np.ndarray  # (m,) bool

    def whole(self, broken: np.ndarray) -> np.ndarray:
        """Pairs that are drawn and not broken."""
        return self.pairs[self.drawn & ~broken[self.rows]]


@dataclass(frozen=True, eq=False)
class Tearable:
    """The triangles of a group of one world, some of whose edges may break."""

    prim: MeshPrim
    triangles: np.ndarray  # (t, 3), within the group
    sides: list[tuple[Any, np.ndarray]]  # bound constraint, (t, 3) rows of its ``broken`` or -1

    def whole(self, broken: Mapping[Any, np.ndarray]) -> np.ndarray:
        """Triangles with all of their edges."""
        torn = np.zeros(len(self.triangles), dtype=bool)
        for constraint, rows in self.sides:
            torn |= np.append(broken[constraint], False)[rows].any(axis=1)
        return self.triangles[~torn]


def breakable_sides(
    constraints: Iterable[Any], w: int, triangles: np.ndarray
) -> Iterator[tuple[Any, np.ndarray]]:
    """Of each constraint that may break sides of triangles of world w: the rows of these sides."""
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
    for part in constraints:
        if getattr(part, "break_force", None) is None:
            continue
        first = sum(len(peer.links()) for peer in part.peers[:w])
        pairs = np.sort(part.peers[w].links(), axis=1).tolist()
        row = {tuple(pair): first + n for n, pair in enumerate(pairs)}
        rows = [[row.get(tuple(side), -1) for side in three] for three in sides.tolist()]
        if np.max(rows) >= 0:
            yield part, np.array(rows)


def read_broken(constraints: Iterable[Any]) -> dict[Any, np.ndarray]:
    """What is broken now: one copy from the device a constraint, not one a world."""
    return {part: part.read_broken(part) for part in set(constraints)}
