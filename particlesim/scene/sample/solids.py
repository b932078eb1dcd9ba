"""Bodies of tetrahedra, and what bounds them."""

from __future__ import annotations

from typing import Any

import numpy as np

from ... import validate
from .arrange import corners

# Corners of a cube by three bits (x the highest), and its five tetrahedra, four of them at corners
# and one between; all turn the same way round. Neighbours are mirrored, so that diagonals meet.
FIVE = np.array([(0, 4, 2, 1), (6, 2, 4, 7), (5, 4, 1, 7), (3, 1, 2, 7), (4, 2, 1, 7)])
MIRRORED = (FIVE ^ 4)[:, [1, 0, 2, 3]]


def box_tetrahedra(lower: Any, upper: Any, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """A box of tetrahedra: cells of a grid, of five each, mirrored from one to the next.

    Args:
        lower: Lower corner (3,) [length].
        upper: Upper corner (3,) [length].
        spacing: Side of a cell [length], fitted to each side of the box: max(1, round(L / s)) of
            them.

    Returns:
        Vertices (v, 3) [length], and tetrahedra (t, 4) of positive volume: the last vertex lies
        where the cross product of the first two edges points to.

    Raises:
        ValueError: ``upper`` not above ``lower`` on every axis.

    Example:
        >>> vertices, tetrahedra = box_tetrahedra((0, 0, 0), (2, 1, 1), spacing=0.5)
        >>> len(vertices), len(tetrahedra)
        (45, 80)
    """
    owner = "sample.box_tetrahedra"
    low, high = corners(owner, lower, upper)
    spacing = validate.number(owner, "spacing", spacing, above=0.0, unit="length")
    extent = high - low
    if not extent.all():
        raise validate.fail(owner, "upper", "be above lower on every axis", high, "give a volume")
    counts = np.maximum(1, np.floor(extent / spacing + 0.5)).astype(int)
    cells = np.moveaxis(np.indices(counts), 0, -1).reshape(-1, 3)
    bits = np.array([(k >> 2 & 1, k >> 1 & 1, k & 1) for k in range(8)])
    corner = np.ravel_multi_index(np.moveaxis(cells[:, None] + bits, -1, 0), tuple(counts + 1))
    odd = cells.sum(axis=1) % 2 == 1
    local = np.where(odd[:, None, None], MIRRORED, FIVE).reshape(-1, 20)
    vertices = np.moveaxis(np.indices(counts + 1), 0, -1).reshape(-1, 3)
    tetrahedra = np.take_along_axis(corner, local, axis=1).reshape(-1, 4)
    return low + vertices * (extent / counts), tetrahedra


def surface(tetrahedra: Any) -> np.ndarray:
    """The triangles that bound tetrahedra: faces of one alone.

    Args:
        tetrahedra: (t, 4) indices of vertices, of positive volume.

    Returns:
        (f, 3) indices of vertices, counterclockwise from outside.

    Example:
        >>> surface([(0, 1, 2, 3)]).tolist()
        [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]
    """
    owner = "sample.surface"
    index = np.asarray(tetrahedra)
    if index.ndim != 2 or index.shape[1] != 4 or not np.issubdtype(index.dtype, np.integer):
        raise validate.fail(
            owner, "tetrahedra", "be whole numbers of shape (t, 4)", index, "give four a row"
        )
    faces = index[:, [0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2]].reshape(-1, 3)
    _, back, count = np.unique(
        np.sort(faces, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    return faces[count[back.ravel()] == 1].astype(np.int64)


def volumes(vertices: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """Of tetrahedra, with the sign of their sense, (t,)."""
    a, b, c, d = vertices[tetrahedra.T]
    return (np.cross(b - a, c - a) * (d - a)).sum(axis=1) / 6.0
