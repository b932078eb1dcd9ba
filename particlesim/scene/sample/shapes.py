"""Fillings of shapes and lattices."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ... import validate
from .arrange import corners, make_generator

# Positions of the atoms in one cell, as fractions of the cell, and the cell's sides in units of
# the lattice constant. The cell of hcp is the orthorhombic one, with the ideal c/a = sqrt(8/3).
LATTICES: dict[str, tuple[tuple[tuple[float, float, float], ...], tuple[float, float, float]]] = {
    "sc": (((0, 0, 0),), (1, 1, 1)),
    "bcc": (((0, 0, 0), (1 / 2, 1 / 2, 1 / 2)), (1, 1, 1)),
    "fcc": (((0, 0, 0), (1 / 2, 1 / 2, 0), (1 / 2, 0, 1 / 2), (0, 1 / 2, 1 / 2)), (1, 1, 1)),
    "hcp": (
        ((0, 0, 0), (1 / 2, 1 / 2, 0), (1 / 2, 5 / 6, 1 / 2), (0, 1 / 3, 1 / 2)),
        (1, math.sqrt(3), math.sqrt(8 / 3)),
    ),
}


def box(lower: Any, upper: Any, spacing: float, jitter: float = 0.0, seed: int = 0) -> np.ndarray:
    """Fill a box with points on a cubic grid.

    An axis of extent L gets max(1, round(L / spacing)) points, ``spacing`` apart, the grid centred
    in the box: the first is half a spacing from the wall where L is a multiple of the spacing. A
    flat axis (L = 0) gets one layer, so a box can be a plane, a line or a point.

    Args:
        lower: Lower corner (3,) [length].
        upper: Upper corner (3,) [length].
        spacing: Distance of neighbouring points [length].
        jitter: Random displacement, as a fraction of the spacing; none along a flat axis.
        seed: Seed of the jitter.

    Returns:
        Points (n, 3) [length], z fastest.

    Raises:
        ValueError: ``upper`` below ``lower``.

    Example:
        >>> box((0, 0, 0), (1, 1, 0), spacing=0.5).tolist()[:2]
        [[0.25, 0.25, 0.0], [0.25, 0.75, 0.0]]
    """
    low, high = corners("sample.box", lower, upper)
    spacing = validate.number("sample.box", "spacing", spacing, above=0.0, unit="length")
    extent = high - low
    counts = np.maximum(1, np.floor(extent / spacing + 0.5)).astype(int)
    points = (low + high) / 2 + _grid(counts, spacing)
    shift = _jitter("sample.box", points.shape, spacing, jitter, seed)
    return np.clip(points + np.where(extent > 0, shift, 0.0), low, high)


def sphere(
    center: Any, radius: float, spacing: float, jitter: float = 0.0, seed: int = 0
) -> np.ndarray:
    """Fill a ball with points on a cubic grid that has a point at the centre.

    Args:
        center: Centre (3,) [length].
        radius: Radius [length]; points at exactly the radius belong to the ball.
        spacing: Distance of neighbouring points [length].
        jitter: Random displacement, as a fraction of the spacing; points moved out are left out.
        seed: Seed of the jitter.

    Returns:
        Points (n, 3) [length], at least one, unless the jitter moved the only one out.
    """
    owner = "sample.sphere"
    middle = validate.vector(owner, "center", center, unit="length")
    radius = validate.number(owner, "radius", radius, above=0.0, unit="length")
    spacing = validate.number(owner, "spacing", spacing, above=0.0, unit="length")
    half = _half_count(radius, spacing)
    points = _grid(np.full(3, 2 * half + 1), spacing)
    points = points + _jitter(owner, points.shape, spacing, jitter, seed)
    inside = np.linalg.norm(points, axis=1) <= _rounded_up(radius)
    return middle + points[inside]


def cylinder(
    start: Any, end: Any, radius: float, spacing: float, jitter: float = 0.0, seed: int = 0
) -> np.ndarray:
    """Fill a cylinder, along any direction, with layers of points on a square grid.

    Along the axis of length L lie max(1, round(L / spacing)) layers as in :func:`box`; each layer
    has a point on the axis.

    Args:
        start: Middle of one end (3,) [length].
        end: Middle of the other end (3,) [length].
        radius: Radius [length]; points at exactly the radius belong to the cylinder.
        spacing: Distance of neighbouring points [length].
        jitter: Random displacement, as a fraction of the spacing; points moved out are left out.
        seed: Seed of the jitter.

    Returns:
        Points (n, 3) [length], layer by layer from ``start``.

    Raises:
        ValueError: Ends that coincide.
    """
    owner = "sample.cylinder"
    bottom = validate.vector(owner, "start", start, unit="length")
    top = validate.vector(owner, "end", end, unit="length")
    radius = validate.number(owner, "radius", radius, above=0.0, unit="length")
    spacing = validate.number(owner, "spacing", spacing, above=0.0, unit="length")
    length = float(np.linalg.norm(top - bottom))
    if length == 0.0:
        raise validate.fail(owner, "end", "differ from start", end, "give the other end")
    half = _half_count(radius, spacing)
    layers = max(1, math.floor(length / spacing + 0.5))
    points = _grid(np.array([layers, 2 * half + 1, 2 * half + 1]), spacing)
    points = points + _jitter(owner, points.shape, spacing, jitter, seed)
    inside = np.hypot(points[:, 1], points[:, 2]) <= _rounded_up(radius)
    inside &= np.abs(points[:, 0]) <= _rounded_up(length / 2)
    return (bottom + top) / 2 + points[inside] @ _frame((top - bottom) / length)


def lattice(kind: str, cells: Any, constant: float, origin: Any = (0.0, 0.0, 0.0)) -> np.ndarray:
    """A piece of a crystal.

    The piece fills a periodic box of the cell's sides times ``cells``: ``constant`` on each axis
    for sc, bcc and fcc, (1, sqrt(3), sqrt(8/3)) times ``constant`` for hcp. Neighbouring atoms are
    constant, sqrt(3)/2, sqrt(1/2) and 1 times ``constant`` apart.

    Args:
        kind: ``"sc"``, ``"bcc"``, ``"fcc"`` or ``"hcp"``: 1, 2, 4 and 4 atoms a cell.
        cells: Cells along each axis, one number or three.
        constant: Side a of the cubic cell, for hcp the distance of neighbours [length].
        origin: Where the first atom is (3,) [length]; the rest lie on the positive side.

    Returns:
        Points (n, 3) [length], cell by cell.

    Raises:
        ValueError: An unknown kind, less than one cell.

    Example:
        >>> len(lattice("fcc", 10, constant=1.68))
        4000
    """
    owner = "sample.lattice"
    atoms, sides = LATTICES[validate.choice(owner, "kind", kind, LATTICES)]
    constant = validate.number(owner, "constant", constant, above=0.0, unit="length")
    start = validate.vector(owner, "origin", origin, unit="length")
    numbers = [cells] * 3 if np.ndim(cells) == 0 else list(cells)
    if len(numbers) != 3:
        raise validate.fail(owner, "cells", "be one number or three", cells, "give (nx, ny, nz)")
    counts = [validate.whole(owner, "cells", number, minimum=1) for number in numbers]
    corners = np.moveaxis(np.indices(counts), 0, -1).reshape(-1, 1, 3)
    fractions = (corners + np.array(atoms)).reshape(-1, 3)
    return start + fractions * np.array(sides) * constant


def _grid(counts: np.ndarray, spacing: float) -> np.ndarray:
    """A cubic grid of points, (n, 3), centred on the origin, the last axis fastest."""
    axes = [(np.arange(count) - (count - 1) / 2) * spacing for count in counts]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def _half_count(radius: float, spacing: float) -> int:
    """Grid points on one side of the middle that a radius reaches."""
    return math.floor(_rounded_up(radius / spacing))


def _rounded_up(length: float) -> float:
    """A length with room for round-off, so that a point exactly at it counts as inside."""
    return length * (1.0 + 1e-9)


def _frame(axis: np.ndarray) -> np.ndarray:
    """Right-handed orthonormal rows (3, 3), the first of them the unit vector ``axis``."""
    helper = np.eye(3)[np.argmin(np.abs(axis))]
    second = np.cross(axis, helper)
    second /= np.linalg.norm(second)
    return np.array([axis, second, np.cross(axis, second)])


def _jitter(
    owner: str, shape: tuple[int, ...], spacing: float, jitter: float, seed: int
) -> np.ndarray:
    generator = make_generator(owner, seed)
    jitter = validate.number(owner, "jitter", jitter, minimum=0.0, maximum=0.5)
    return generator.uniform(-jitter, jitter, shape) * spacing
