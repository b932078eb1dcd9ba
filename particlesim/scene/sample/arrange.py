"""Turning points, and finding which of them belong together."""

from __future__ import annotations

from typing import Any

import numpy as np

from ... import validate


def rotate(points: Any, axis: Any, angle: float, center: Any = (0.0, 0.0, 0.0)) -> np.ndarray:
    """Points turned about an axis, right-handed (Rodrigues 1840).

    Args:
        points: Points (n, 3) [length].
        axis: Direction of the axis (3,), of any length.
        angle: [rad].
        center: A point on the axis (3,) [length].

    Returns:
        Points (n, 3) [length].
    """
    owner = "sample.rotate"
    rows = validate.rows(owner, "points", points, None, 3)
    middle = validate.vector(owner, "center", center, unit="length")
    direction = validate.vector(owner, "axis", axis)
    length = float(np.linalg.norm(direction))
    if length == 0:
        raise validate.fail(owner, "axis", "have a length", direction, "give a direction")
    k, d = direction / length, rows - middle
    angle = validate.number(owner, "angle", angle, unit="rad")
    along = (d @ k)[:, None] * k
    return middle + along + np.cos(angle) * (d - along) + np.sin(angle) * np.cross(k, d)


def links(points: Any, distance: float) -> np.ndarray:
    """Pairs of points no further apart than a distance: springs and bonds of a lattice.

    Args:
        points: Points (n, 3) [length].
        distance: [length]; a little more than the lattice distance that is meant.

    Returns:
        (m, 2) indices, the smaller first, in order.
    """
    owner = "sample.links"
    rows = validate.rows(owner, "points", points, None, 3)
    distance = validate.number(owner, "distance", distance, above=0.0, unit="length")
    cells: dict[tuple[int, ...], list[int]] = {}
    keys = np.floor((rows - rows.min(axis=0, initial=0.0)) / distance).astype(np.int64)
    for k, key in enumerate(map(tuple, keys.tolist())):
        cells.setdefault(key, []).append(k)
    steps = np.stack(np.meshgrid(*[(-1, 0, 1)] * 3), axis=-1).reshape(-1, 3)
    found = [np.zeros((0, 2), dtype=np.int64)]
    for key, mine in cells.items():
        around = [cells.get(tuple(k), ()) for k in (np.array(key) + steps).tolist()]
        others = np.concatenate([np.array(each, dtype=np.int64) for each in around])
        first, second = np.meshgrid(mine, others, indexing="ij")
        near = np.linalg.norm(rows[first] - rows[second], axis=2) <= distance
        near &= first < second
        found.append(np.stack([first[near], second[near]], axis=1))
    pairs = np.concatenate(found)
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


def corners(owner: str, lower: Any, upper: Any) -> tuple[np.ndarray, np.ndarray]:
    """Two corners of a box, the lower first."""
    low = validate.vector(owner, "lower", lower, unit="length")
    high = validate.vector(owner, "upper", upper, unit="length")
    if np.any(high < low):
        raise validate.fail(
            owner, "upper", f"be at least lower {low.tolist()} [length]", high, "swap the corners"
        )
    return low, high


def make_generator(owner: str, seed: int) -> np.random.Generator:
    """Random numbers that a seed repeats."""
    return np.random.default_rng(validate.whole(owner, "seed", seed))
