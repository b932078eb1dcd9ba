"""What a surface of triangles encloses, and which of its points are nearest."""

from __future__ import annotations

from typing import Any

import numpy as np

from ... import validate
from .meshes import closed

PORTION = 1 << 20  # point and triangle pairs that are looked at at once


def inside(points: Any, vertices: Any, triangles: Any) -> np.ndarray:
    """Which points a closed surface has within.

    Those about which it winds: the solid angles of the triangles, with their signs, sum to 4 pi
    there and to 0 outside (Van Oosterom and Strackee 1983, eq. 8; Jacobson et al. 2013).

    Args:
        points: (n, 3) [length].
        vertices: (v, 3) [length].
        triangles: (t, 3) indices of vertices, counterclockwise from outside.

    Returns:
        (n,) bool.

    Raises:
        ValueError: A surface that is not closed: an edge that is not shared by two triangles which
            turn the same way round.

    Example:
        >>> from particlesim import sample
        >>> inside([(0, 0, 0), (0, 2, 0)], *sample.icosphere((0, 0, 0), 1.0)).tolist()
        [True, False]
    """
    owner = "sample.inside"
    x = validate.rows(owner, "points", points, None, 3)
    corners, index = closed(owner, vertices, triangles)
    result = np.zeros(len(x), dtype=bool)
    step = max(1, PORTION // len(index))
    for first in range(0, len(x), step):
        a, b, c = (corners[each] - x[first : first + step, None] for each in index.T)
        la, lb, lc = (np.linalg.norm(each, axis=2) for each in (a, b, c))
        above = (a * np.cross(b, c)).sum(axis=2)
        below = (
            la * lb * lc + (a * b).sum(axis=2) * lc + (b * c).sum(axis=2) * la
            + (c * a).sum(axis=2) * lb
        )  # fmt: skip
        turns = np.arctan2(above, below).sum(axis=1) / (2.0 * np.pi)
        result[first : first + step] = turns > 0.5
    return result


def grid_inside(
    low: np.ndarray, counts: np.ndarray, side: float, vertices: np.ndarray, triangles: np.ndarray
) -> np.ndarray:
    """The same of the points of a cubic grid, low + (i, j, k) s, bool of the shape ``counts``.

    From one point to the next along z nothing changes where no triangle's box is between: only the
    others are looked at.
    """
    asked = np.zeros(counts, dtype=bool)
    corner = (vertices[triangles] - low) / side
    first = np.maximum(np.ceil(corner.min(axis=1) - 1e-6), 0).astype(int)
    last = np.floor(corner.max(axis=1) + 1e-6).astype(int) + np.array([1, 1, 2])
    for (i, j, k), (end_i, end_j, end_k) in zip(first.tolist(), last.tolist(), strict=True):
        asked[i:end_i, j:end_j, k:end_k] = True
    result = np.zeros(counts, dtype=bool)
    result[asked] = inside(low + np.argwhere(asked) * side, vertices, triangles)
    before = np.maximum.accumulate(np.where(asked, np.arange(counts[2]), 0), axis=2)
    return np.take_along_axis(result, before, axis=2)


def nearest(points: np.ndarray, vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """The point of a surface that is nearest to each of some points, (n, 3).

    On each triangle the foot on its plane, where that is within, or the nearest of its sides.
    """
    result = np.empty_like(points)
    step = max(1, PORTION // len(triangles))
    for first in range(0, len(points), step):
        x = points[first : first + step, None]
        a, b, c = (vertices[each] for each in triangles.T)
        found = [_on_plane(x, a, b, c), _on_side(x, a, b), _on_side(x, b, c), _on_side(x, c, a)]
        every = np.concatenate(found, axis=1)
        best = np.argmin(((every - x) ** 2).sum(axis=2), axis=1)
        result[first : first + step] = every[np.arange(len(every)), best]
    return result


def _on_side(x: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    d = b - a
    part = ((x - a) * d).sum(axis=2) / (d * d).sum(axis=1)
    return a + np.clip(part, 0.0, 1.0)[..., None] * d


def _on_plane(x: np.ndarray, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """The foot on the triangle's plane; its corner a where that is outside, as of flat ones."""
    n = np.cross(b - a, c - a)
    square = (n * n).sum(axis=1)
    scale = np.where(square > 0, square, 1.0)
    foot = x - (((x - a) * n).sum(axis=2) / scale)[..., None] * n
    within = np.ones(foot.shape[:2], dtype=bool)
    for p, q in ((a, b), (b, c), (c, a)):
        within &= (np.cross(q - p, foot - p) * n).sum(axis=2) >= 0
    return np.where((within & (square > 0))[..., None], foot, a)
