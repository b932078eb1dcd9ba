"""What makes a body: particles, and constraints that hold them together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ... import validate
from ...scene.constraint_base import ConstraintBase
from ...scene.group import Group
from ...scene.scene import Scene


@dataclass(frozen=True, eq=False)
class Body:
    """A body of a scene, as ``scene.add_rope`` and its like make it.

    Attributes:
        group: Its particles; ``group[k]`` is the one of the k-th point that was given, and
            ``group.triangles`` what it is drawn as.
        constraints: What holds it, by name, for ``sim.force`` and ``sim.broken``.
    """

    group: Group
    constraints: Mapping[str, ConstraintBase]

    @property
    def indices(self) -> np.ndarray:
        """Indices of its particles in the scene, (n,) int."""
        return self.group.indices


def add_body(
    scene: Scene, points: np.ndarray, constraints: Mapping[str, ConstraintBase], **options: Any
) -> Body:
    """Particles, and constraints that were made for them, as the scene's next.

    Constraints come second: what ``add_particles`` refuses leaves nothing behind.
    """
    group = scene.add_particles(points, **options)
    for each in constraints.values():
        scene.add_constraint(each)
    return Body(group, constraints)


def held(owner: str, pinned: Any, count: int) -> np.ndarray:
    """Which points are pinned, (count,) bool, of their numbers or of that itself."""
    index = np.asarray(pinned)
    if index.size == 0:
        return np.zeros(count, dtype=bool)
    if index.dtype == bool and index.shape in ((), (count,)):
        return np.broadcast_to(index, count)
    if index.ndim != 1 or not np.issubdtype(index.dtype, np.integer):
        raise validate.fail(
            owner, "pinned", f"be numbers of points, or ({count},) bool", pinned, "give some"
        )
    if index.min() < -count or index.max() >= count:
        worst = index.max() if index.max() >= count else index.min()
        raise validate.fail(
            owner, "pinned", f"hold numbers from 0 to {count - 1}", int(worst),
            "count the points from 0",
        )  # fmt: skip
    result = np.zeros(count, dtype=bool)
    result[index] = True
    return result


def compliance(owner: str, name: str, stiffness: Any, unit: str) -> float:
    """The inverse of a stiffness; None is rigid."""
    if stiffness is None:
        return 0.0
    return 1.0 / validate.number(owner, name, stiffness, above=0.0, unit=unit)


def shares(index: np.ndarray, measure: np.ndarray, count: int) -> np.ndarray:
    """What each point has of lengths, areas or volumes that their ends share alike, (count,)."""
    each = np.repeat(measure / index.shape[1], index.shape[1])
    return np.bincount(index.ravel(), weights=each, minlength=count)


def massive(owner: str, argument: str, share: np.ndarray) -> None:
    """Refuse points that none of the pieces weighs down."""
    if not share.all():
        raise validate.fail(
            owner, argument, "have every point in a piece of some size",
            f"point {int(np.argmin(share))} in none", "leave it out",
        )  # fmt: skip
