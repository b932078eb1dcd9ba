"""Where a recording puts worlds side by side, and how far open boundaries are drawn."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ... import validate
from ...engine.source import Source
from ...scene.scene import Scene

GRID_GAP = 0.2  # between worlds, in parts of the largest


def offsets(owner: str, layout: Any, scenes: Mapping[int, Scene]) -> dict[int, np.ndarray] | None:
    """Where each world is put, (3,) [length].

    Args:
        owner: For errors.
        layout: None: where it is; (3,): that far from the one before; ``"grid"``: in rows on the
            ground, as far apart as the largest world at the start needs.
        scenes: The worlds in order, by number.

    Raises:
        ValueError: A layout that is none of these.
    """
    if layout is None:
        return None
    if not isinstance(layout, str):
        step = validate.vector(owner, "layout", layout, unit="length")
        return {w: k * step for k, w in enumerate(scenes)}
    validate.choice(owner, "layout", layout, ["grid"])
    size = np.max([_reach(scene) for scene in scenes.values()], axis=0)
    deep = 2 if next(iter(scenes.values())).up_axis == "y" else 1
    cell = np.arange(len(scenes))
    columns = int(np.ceil(np.sqrt(len(scenes))))
    cells = np.zeros((len(scenes), 3))
    cells[:, 0] = cell % columns
    # Away from the camera, which looks along -z, or y.
    cells[:, deep] = cell // columns * (-1.0 if deep == 2 else 1.0)
    return dict(zip(scenes, cells * size * (1.0 + GRID_GAP), strict=True))


def _reach(scene: Scene) -> np.ndarray:
    """How long a scene is on each axis at the start, with its particles' radii and boxes; (3,)."""
    radius = scene.radius[:, None]
    corners = [scene.position - radius, scene.position + radius]
    for part in scene.constraints:
        for shape in part.shapes():
            if shape["kind"] == "box":
                box = closed(shape, scene.position)
                corners += [box["lower"][None], box["upper"][None]]
    if scene.periodic is not None:
        lower, upper, on = scene.periodic
        corners += [np.where(on, each, scene.position[:1]) for each in (lower, upper)]
    longest = np.ptp(np.concatenate(corners), axis=0)
    return np.where(longest > 0, longest, 1.0)


def periodic_box(sim: Source) -> tuple[np.ndarray, np.ndarray] | None:
    """The box at the start, where all worlds have the same and keep it so."""
    length, lower = sim.model.box_start, sim.model.box_lower
    if sim.model.flexible and sim.model.world_count > 1:
        return None
    if not sim.model.periodic or np.ptp(length, axis=0).any() or np.ptp(lower, axis=0).any():
        return None
    on = length[0] > 0
    return np.where(on, lower[0], np.nan), np.where(on, lower[0] + length[0], np.nan)


def closed(shape: Mapping[str, Any], position: np.ndarray) -> dict[str, Any]:
    """A shape of a boundary; open sides of a box end where the particles start."""
    described = dict(shape)
    if described["kind"] != "box":
        return described
    below, above = (np.asarray(described[k], dtype=float) for k in ("lower", "upper"))
    lower = np.where(np.isfinite(below), below, np.minimum(position.min(axis=0), above))
    upper = np.where(np.isfinite(above), above, np.maximum(position.max(axis=0), below))
    # All particles may start on the side opposite an open one: then as far as the box is long.
    flat, longest = upper <= lower, float((upper - lower).max()) or 1.0
    opened = flat & ~np.isfinite(above)
    described["upper"] = np.where(opened, lower + longest, upper)
    described["lower"] = np.where(flat & ~opened, upper - longest, lower)
    return described
