"""Points and tetrahedra that fill what a surface encloses."""

from __future__ import annotations

from typing import Any

import numpy as np

from ... import validate
from .enclosed import grid_inside, nearest
from .meshes import closed
from .solids import volumes

THINNEST = 0.1  # of its volume that a tetrahedron keeps where it is fitted to a surface
LEAST = 1 / 16  # of the way to the surface that is still gone


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
    side = validate.number(owner, "spacing", spacing, above=0.0, unit="length")
    x, faces = closed(owner, vertices, triangles)
    low, counts = _grid(x, side)
    found = np.argwhere(grid_inside(low + 0.5 * side, counts, side, x, faces))
    _some(owner, found, x)
    return low + (found + 0.5) * side


def mesh_tetrahedra(
    vertices: Any, triangles: Any, spacing: float
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Fill a closed surface with tetrahedra: those of a body-centred lattice that are within.

    Of each edge of the lattice that passes the surface, the nearer end is put onto it (after
    Labelle and Shewchuk 2007), where that leaves each tetrahedron a tenth of its volume: edges
    and thin parts of the surface are rounded off. Programs for meshes that keep these, such as
    fTetWild, write files that :func:`sample.mesh` reads.

    Args:
        vertices: (v, 3) [length].
        triangles: (t, 3) indices of vertices, counterclockwise from outside.
        spacing: Side of a cube of the lattice, of twelve tetrahedra [length].

    Returns:
        Vertices and tetrahedra, as of :func:`sample.box_tetrahedra`.

    Raises:
        ValueError: As :func:`sample.mesh_points`.
    """
    owner = "sample.mesh_tetrahedra"
    side = validate.number(owner, "spacing", spacing, above=0.0, unit="length")
    skin, faces = closed(owner, vertices, triangles)
    x, index, within = _lattice(skin, faces, side)
    _some(owner, index, skin)
    ends = index[:, [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]].reshape(-1, 2)
    passing = np.unique(np.sort(ends[within[ends[:, 0]] != within[ends[:, 1]]], axis=1), axis=0)
    near = np.unique(passing)
    way = np.zeros_like(x)
    way[near] = nearest(x[near], skin, faces) - x[near]
    far = np.linalg.norm(way, axis=1)
    moved = np.zeros(len(x), dtype=bool)
    moved[np.where(far[passing[:, 0]] <= far[passing[:, 1]], *passing.T)] = True
    way[~moved] = 0.0
    kept = (within & ~moved)[index].any(axis=1) & (within | moved)[index].all(axis=1)
    # Thin ones with a face on the surface are as well left out.
    thin = volumes(x + way, index) < THINNEST * volumes(x, index)
    kept &= ~(thin & (moved[index].sum(axis=1) == 3))
    _some(owner, index[kept], skin)
    used, index = np.unique(index[kept], return_inverse=True)
    return _fitted(x[used], way[used], index.reshape(-1, 4))


def _lattice(
    skin: np.ndarray, faces: np.ndarray, side: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices and tetrahedra with one within, of a body-centred lattice; which are within."""
    low, counts = _grid(skin, side)
    low, counts = low - side, counts + 2  # so that the outermost of the lattice are outside
    grids = [(low, counts + 1), (low + 0.5 * side, counts)]  # corners of the cells, and middles
    within = np.concatenate(
        [grid_inside(start, n, side, skin, faces).ravel() for start, n in grids]
    )
    x = np.concatenate([start + np.argwhere(np.ones(n, bool)) * side for start, n in grids])
    index = _body_centred(counts)
    used, index = np.unique(index[within[index].any(axis=1)], return_inverse=True)
    return x[used], index.reshape(-1, 4), within[used]


def _fitted(
    x: np.ndarray, way: np.ndarray, tetrahedra: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Vertices moved as far on their ways as leaves no tetrahedron too thin."""
    part, least = np.ones((len(x), 1)), THINNEST * volumes(x, tetrahedra)
    # It comes to an end: what is too thin has a vertex that moves, and goes less far than before.
    while (thin := volumes(x + part * way, tetrahedra) < least).any():
        part[tetrahedra[thin]] *= 0.5
        part[part < LEAST] = 0.0
    return x + part * way, tetrahedra


def _body_centred(counts: np.ndarray) -> np.ndarray:
    """Tetrahedra of a body-centred lattice: of two neighbouring middles and a side between them.

    Vertices are the corners of the cells, then their middles.
    """
    corner = np.arange(np.prod(counts + 1)).reshape(counts + 1)
    middle = corner.size + np.arange(np.prod(counts)).reshape(counts)
    found = []
    for axis in range(3):
        # With this axis in front, and the other two such that the three are right-handed.
        c = np.transpose(corner, np.roll((0, 1, 2), -axis))
        m = np.transpose(middle, np.roll((0, 1, 2), -axis))
        ring = [c[1:-1, :-1, :-1], c[1:-1, 1:, :-1], c[1:-1, 1:, 1:], c[1:-1, :-1, 1:]]
        for k in range(4):
            four = (m[:-1], m[1:], ring[k], ring[(k + 1) % 4])
            found.append(np.stack([each.ravel() for each in four], axis=1))
    return np.concatenate(found)


def _grid(x: np.ndarray, side: float) -> tuple[np.ndarray, np.ndarray]:
    """Lower corner and numbers of the cells of a grid about points, in whose middle they are."""
    extent = np.ptp(x, axis=0)
    counts = np.maximum(1, np.ceil(extent / side - 1e-9)).astype(int)
    return x.min(axis=0) + 0.5 * (extent - counts * side), counts


def _some(owner: str, found: np.ndarray, x: np.ndarray) -> None:
    """Refuse a spacing that fits nothing in."""
    if not len(found):
        extent = float(np.ptp(x, axis=0).min())
        raise validate.fail(
            owner, "spacing", f"be below the size of the mesh, {extent:g} [length]", "none within",
            "give a smaller one",
        )  # fmt: skip
