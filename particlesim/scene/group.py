"""Group: particles of a scene that were added together, and what stands for particles."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from .. import validate

Color = tuple[float, float, float]
PALETTE: tuple[Color, ...] = (
    (0.26, 0.52, 0.86), (0.90, 0.45, 0.20), (0.35, 0.70, 0.40), (0.80, 0.30, 0.45),
    (0.60, 0.45, 0.80), (0.85, 0.70, 0.25), (0.40, 0.70, 0.75), (0.60, 0.55, 0.50),
)  # fmt: skip


class Group:
    """A run of particles of a scene, made by one ``add_particles``.

    ``group[k]`` is the index in the scene of the group's k-th particle; slices and arrays give
    arrays of indices, ready for pairs and constraints. ``triangles`` (t, 3) int, counted within the
    group, is the surface that it is drawn as; None: it is drawn as points.
    """

    def __init__(
        self,
        scene: Any,
        name: str,
        start: int,
        stop: int,
        color: Color,
        triangles: np.ndarray | None = None,
    ):
        self.scene, self.name, self.start, self.stop = scene, name, start, stop
        self.color, self.triangles = color, triangles

    def __len__(self) -> int:
        return self.stop - self.start

    def __iter__(self) -> Iterator[int]:
        return iter(range(self.start, self.stop))

    def __getitem__(self, key: Any) -> Any:
        picked = self.indices[key]
        return int(picked) if np.isscalar(picked) or picked.ndim == 0 else picked

    def __repr__(self) -> str:
        return f"Group({self.name!r}, {len(self)} particles)"

    @property
    def indices(self) -> np.ndarray:
        """Indices of the group's particles in the scene, (n,) int."""
        return np.arange(self.start, self.stop)

    @property
    def slice(self) -> slice:
        """The group's rows in the scene's arrays."""
        return slice(self.start, self.stop)


def select(scene: Any, group: Any, owner: str) -> np.ndarray:
    """Sorted indices that ``group`` stands for.

    Args:
        scene: Whose particles.
        group: None (all), a Group or its name, several of these, indices, or (n,) bool.
        owner: For errors.
    """
    if group is None:
        return np.arange(scene.particle_count)
    if isinstance(group, str):
        names = [each.name for each in scene.groups]
        return scene[validate.choice(owner, "group", group, names)].indices
    if isinstance(group, Group):
        if group.scene is not scene:
            raise validate.fail(owner, "group", "belong to the scene", group, "use its own group")
        return group.indices
    if isinstance(group, list | tuple) and group and all(isinstance(g, Group | str) for g in group):
        return np.unique(np.concatenate([select(scene, g, owner) for g in group]))
    index = np.asarray(group)
    if index.size == 0:
        return np.zeros(0, dtype=np.int64)
    if index.dtype == bool:
        if index.shape != (scene.particle_count,):
            raise validate.fail(
                owner, "group", f"have shape ({scene.particle_count},) where it is True and False",
                index.shape, "give one for each particle of the scene",
            )  # fmt: skip
        return np.nonzero(index)[0]
    if index.ndim != 1 or not np.issubdtype(index.dtype, np.integer):
        raise validate.fail(
            owner, "group", "be groups, their names or indices", group, "pass a Group"
        )
    if index.min() < 0 or index.max() >= scene.particle_count:
        worst = index.max() if index.max() >= scene.particle_count else index.min()
        raise validate.fail(
            owner, "group", f"hold indices from 0 to {scene.particle_count - 1}", int(worst),
            "index the scene's particles",
        )  # fmt: skip
    return np.unique(index)
