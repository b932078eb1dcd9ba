"""Walls: what boundaries are to those who fill the space in front of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Wall:
    """A boundary in all worlds, as a continuum meets it: how far its sides are, and where they go.

    Args:
        name: Of the boundary.
        peers: The boundary in the scene of every world.
        places: Of each side which place among those of the boundary it takes: a particle sees the
            nearest of those that share one.
        sticky: A viscous fluid sticks to it.
        facing: Warp function ``(x, p) -> (d, N)``: of the place x, as the boundary is described,
            the signed distances of the sides, positive in front of them, and the unit normals,
            (sides, 3), to there.
        Params: Struct of the surface's parameters.
        params: These, one a world.
        pose: Where it is, one a world; of length 0 where nothing moves.
        follow: Brings the poses to the present time; to be recorded.
    """

    name: str
    peers: Sequence[Any]
    places: Sequence[int]
    sticky: bool
    facing: Any
    Params: Any
    params: Any
    pose: Any
    follow: Callable[[], None]
