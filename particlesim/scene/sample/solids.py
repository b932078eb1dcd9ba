"""Bodies of tetrahedra, and points within surfaces."""

from __future__ import annotations

from typing import Any

import numpy as np

from ... import validate
from .arrange import corners
from .meshes import closed, inside

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
    return _cells(np.ones(counts, dtype=bool), low, extent / counts)


def mesh_points(vertices: Any, triangles: Any, spacing: float) -> np.ndarray:
    """Fill a closed surface with points on a cubic grid, as :func:`sample.box` fills a box.

    Args:
        vertices: (v, 3) [length].
        triangles: (t, 3) indices of vertices, counterclockwise from outside.
        spacing: Distance of neighbouring points [length].

    Returns:
        Points (n, 3) [length].

    Raises:
        ValueError: As :func:`sample.inside`, and a surface that no point of the grid is within.
    """
    owner = "sample.mesh_points"
    low, filled, spacing = _filled(owner, vertices, triangles, spacing)
    return low + (np.argwhere(filled) + 0.5) * spacing


def mesh_tetrahedra(
    vertices: Any, triangles: Any, spacing: float
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Fill a closed surface with tetrahedra: the cells of a grid whose middles are within.

    The surface of the result has steps of a cell. Programs for meshes that follow it, such as
    fTetWild, write files that :func:`sample.mesh` reads.

    Args:
        vertices: (v, 3) [length].
        triangles: (t, 3) indices of vertices, counterclockwise from outside.
        spacing: Side of a cell [length].

    Returns:
        Vertices and tetrahedra, as of :func:`sample.box_tetrahedra`.

    Raises:
        ValueError: As :func:`sample.mesh_points`.
    """
    low, filled, spacing = _filled("sample.mesh_tetrahedra", vertices, triangles, spacing)
    return _cells(filled, low, np.full(3, spacing))


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


def _filled(
    owner: str, vertices: Any, triangles: Any, spacing: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Lower corner of a grid over a surface, which of its cells have their middle within, side."""
    spacing = validate.number(owner, "spacing", spacing, above=0.0, unit="length")
    x, index = closed(owner, vertices, triangles)
    extent = np.ptp(x, axis=0)
    counts = np.maximum(1, np.ceil(extent / spacing - 1e-9)).astype(int)
    low = x.min(axis=0) + 0.5 * (extent - counts * spacing)
    # From one middle to the next along z nothing changes where no triangle's box is between.
    asked = np.zeros(counts, dtype=bool)
    corner = (x[index] - low) / spacing - 0.5
    first = np.maximum(np.ceil(corner.min(axis=1) - 1e-6), 0).astype(int)
    last = np.floor(corner.max(axis=1) + 1e-6).astype(int) + np.array([1, 1, 2])
    for (i, j, k), (end_i, end_j, end_k) in zip(first.tolist(), last.tolist(), strict=True):
        asked[i:end_i, j:end_j, k:end_k] = True
    filled = np.zeros(counts, dtype=bool)
    filled[asked] = inside(low + (np.argwhere(asked) + 0.5) * spacing, x, index)
    nearest = np.maximum.accumulate(np.where(asked, np.arange(counts[2]), 0), axis=2)
    filled = np.take_along_axis(filled, nearest, axis=2)
    if not filled.any():
        raise validate.fail(
            owner, "spacing", f"be below the size of the mesh, {extent.min():g} [length]", spacing,
            "give a smaller one",
        )  # fmt: skip
    return low, filled, spacing


def _cells(filled: np.ndarray, low: np.ndarray, side: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and tetrahedra of the cells of a grid that are there."""
    shape = np.array(filled.shape) + 1
    cells = np.argwhere(filled)
    bits = np.array([(k >> 2 & 1, k >> 1 & 1, k & 1) for k in range(8)])
    corner = np.ravel_multi_index(np.moveaxis(cells[:, None] + bits, -1, 0), tuple(shape))
    odd = cells.sum(axis=1) % 2 == 1
    local = np.where(odd[:, None, None], MIRRORED, FIVE).reshape(-1, 20)
    used, index = np.unique(np.take_along_axis(corner, local, axis=1), return_inverse=True)
    at = np.stack(np.unravel_index(used, tuple(shape)), axis=1)
    return low + at * side, index.reshape(-1, 4)
