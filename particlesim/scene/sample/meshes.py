"""Surfaces of triangles: made, and looked at."""

from __future__ import annotations

from typing import Any

import numpy as np

from ... import validate


def rectangle(corner: Any, edges: Any, cells: Any) -> tuple[np.ndarray, np.ndarray]:
    """A rectangle, or parallelogram, of triangles: two for each cell.

    The diagonals of neighbouring cells cross, so that none of the two directions is preferred.

    Args:
        corner: A corner (3,) [length].
        edges: The two sides from there (2, 3) [length]; triangles are counterclockwise as seen
            from where their cross product points to.
        cells: Along each side, one number or two.

    Returns:
        Vertices ((a + 1) (b + 1), 3) [length], those along the second side next to each other, and
        triangles (2 a b, 3).

    Raises:
        ValueError: Sides along one line, less than one cell.

    Example:
        >>> vertices, triangles = rectangle((0, 1, 0), [(0, 0, 1), (1, 0, 0)], cells=4)
        >>> len(vertices), len(triangles)
        (25, 32)
    """
    owner = "sample.rectangle"
    start = validate.vector(owner, "corner", corner, unit="length")
    first, second = validate.rows(owner, "edges", edges, 2, 3)
    size = np.linalg.norm(first) * np.linalg.norm(second)
    if not np.linalg.norm(np.cross(first, second)) > 1e-9 * size:
        raise validate.fail(owner, "edges", "span an area", np.array([first, second]), "turn one")
    counts = [cells] * 2 if np.ndim(cells) == 0 else list(cells)
    if len(counts) != 2:
        raise validate.fail(owner, "cells", "be one number or two", cells, "give (a, b)")
    a, b = (validate.whole(owner, "cells", count, minimum=1) for count in counts)
    i, j = (each.reshape(-1, 1) for each in np.indices((a + 1, b + 1)))
    vertices = start + i / a * first + j / b * second
    k = np.arange((a + 1) * (b + 1)).reshape(a + 1, b + 1)
    corners = np.stack([k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]], axis=-1)
    even = np.indices((a, b)).sum(axis=0) % 2 == 0
    split = np.where(even[..., None], [0, 1, 2, 0, 2, 3], [0, 1, 3, 1, 2, 3])
    return vertices, np.take_along_axis(corners, split, axis=-1).reshape(-1, 3)


def icosphere(center: Any, radius: float, subdivisions: int = 2) -> tuple[np.ndarray, np.ndarray]:
    """A sphere of nearly equal triangles: an icosahedron whose edges are halved again and again.

    Args:
        center: Centre (3,) [length].
        radius: Distance of the vertices from it [length].
        subdivisions: How often the edges are halved, s.

    Returns:
        Vertices (10 4^s + 2, 3) [length], and triangles (20 4^s, 3), counterclockwise from outside.

    Example:
        >>> vertices, triangles = icosphere((0, 0, 0), 1.0, subdivisions=1)
        >>> len(vertices), len(triangles)
        (42, 80)
    """
    owner = "sample.icosphere"
    middle = validate.vector(owner, "center", center, unit="length")
    radius = validate.number(owner, "radius", radius, above=0.0, unit="length")
    golden = (1.0 + 5.0**0.5) / 2.0
    x = np.array([np.roll((0.0, s, t * golden), k)
                  for k in range(3) for s in (-1.0, 1.0) for t in (-1.0, 1.0)])  # fmt: skip
    # Faces are the triples of neighbours, of distance 2; turned so that they face outwards.
    near = np.isclose(np.linalg.norm(x[:, None] - x[None], axis=2), 2.0)
    faces = np.array([(i, j, k) for i in range(12) for j in range(i) for k in range(j)
                      if near[i, j] and near[j, k] and near[i, k]])  # fmt: skip
    a, b, c = x[faces.T]
    inward = (np.cross(b - a, c - a) * a).sum(axis=1) < 0
    faces[inward] = faces[inward][:, ::-1]
    for _ in range(validate.whole(owner, "subdivisions", subdivisions)):
        pairs = edges(faces)
        middles = {tuple(pair): len(x) + n for n, pair in enumerate(pairs.tolist())}
        x = np.concatenate([x, x[pairs].mean(axis=1)])
        halves = np.array(
            [[middles[min(p, q), max(p, q)] for p, q in ((i, j), (j, k), (k, i))]
             for i, j, k in faces.tolist()]
        )  # fmt: skip
        (i, j, k), (ij, jk, ki) = faces.T, halves.T
        quarters = ((i, ij, ki), (ij, j, jk), (ki, jk, k), (ij, jk, ki))
        faces = np.concatenate([np.stack(each, axis=1) for each in quarters])
    return middle + radius * x / np.linalg.norm(x, axis=1, keepdims=True), faces


def edges(triangles: Any) -> np.ndarray:
    """The edges of triangles, each once.

    Args:
        triangles: (t, 3) indices of vertices.

    Returns:
        (m, 2) indices, the smaller first, in order.

    Example:
        >>> edges([(0, 1, 2), (2, 1, 3)]).tolist()
        [[0, 1], [0, 2], [1, 2], [1, 3], [2, 3]]
    """
    index = _triangles("sample.edges", triangles)
    return np.unique(np.sort(_sides(index), axis=1), axis=0)


def closed(owner: str, vertices: Any, triangles: Any) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles that enclose a volume; what does not is refused."""
    corners = validate.rows(owner, "vertices", vertices, None, 3)
    index = validate.triangles(owner, triangles, len(corners))
    sides = _sides(index)
    _oriented(owner, sides)
    there = {tuple(side) for side in sides.tolist()}
    for p, q in sides.tolist():
        if (q, p) not in there:
            raise validate.fail(
                owner, "triangles", "enclose a volume, each edge shared by two of them",
                f"edge {[p, q]} of one alone", "close the hole, or join vertices that coincide",
            )  # fmt: skip
    a, b, c = corners[index.T]
    if not (a * np.cross(b, c)).sum() > 0:
        raise validate.fail(
            owner, "triangles", "be counterclockwise as seen from outside", "a volume below 0",
            "turn them: triangles[:, ::-1]",
        )  # fmt: skip
    return corners, index


def _triangles(owner: str, triangles: Any) -> np.ndarray:
    array = np.asarray(triangles)
    return validate.triangles(owner, array, 1 + int(array.max()) if array.size else 0)


def _sides(index: np.ndarray) -> np.ndarray:
    """The three sides of each triangle, in its own sense, (3 t, 2)."""
    return index[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)


def _oriented(owner: str, sides: np.ndarray) -> None:
    """Refuse sides that go along an edge the same way twice, as those of three triangles must."""
    once, count = np.unique(sides, axis=0, return_counts=True)
    if (count > 1).any():
        raise validate.fail(
            owner, "triangles", "turn the same way round, two of them at an edge at most",
            f"edge {once[np.argmax(count > 1)].tolist()} {count.max()} times the same way",
            "turn some, or leave out what a third triangle adds",
        )  # fmt: skip
