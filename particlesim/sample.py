"""Points and velocities to start from: fillings of shapes, lattices, random points.

Every function returns float64 rows of three, on the host, and the same ones for the same
arguments: randomness comes from a ``seed``. A length is in the scene's own unit.

Fillings put one point into the middle of each cell of a cubic grid, so that a point stands for
``spacing**3`` of volume and a particle of it weighs ``density * spacing**3``. Their ``jitter``
moves each point along each axis by up to that fraction of the spacing, at most 0.5; the result
stays inside the shape.

Bad arguments (not finite, not of the shape given, lengths that are not positive, jitter out of
range, negative counts) are a ``ValueError``; a function's docstring names only its own others.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from . import validate

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
# Darts that miss in a row before a box counts as full.
MISSES_ALLOWED = 20_000
# Radii at which the mass coordinate is tabulated.
STRETCH_INTERVALS = 4096


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
    low, high = _corners("sample.box", lower, upper)
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


def random(
    lower: Any,
    upper: Any,
    count: int,
    seed: int = 0,
    minimum_distance: float | None = None,
    periodic: bool = False,
) -> np.ndarray:
    """Random points in a box, if asked none closer to another than a distance.

    Points are drawn one after the other, uniformly, and one that comes too close to an earlier one
    is drawn again ("random sequential addition"). That fills at most about 0.38 of the volume with
    spheres of this diameter (Widom 1966); up to 0.2 is quick.

    Args:
        lower: Lower corner (3,) [length].
        upper: Upper corner (3,) [length].
        count: Number of points.
        seed: Seed.
        minimum_distance: Least distance of two points [length]; None: any.
        periodic: Measure that distance across the faces of the box too.

    Returns:
        Points (count, 3) [length].

    Raises:
        ValueError: ``upper`` below ``lower``; a minimum distance at which they do not fit.
    """
    owner = "sample.random"
    low, high = _corners(owner, lower, upper)
    count = validate.whole(owner, "count", count)
    generator = _generator(owner, seed)
    if minimum_distance is None:
        return generator.uniform(low, high, (count, 3))
    distance = validate.number(
        owner, "minimum_distance", minimum_distance, above=0.0, unit="length"
    )
    points = _throw_darts(high - low, count, distance, periodic, generator)
    if len(points) < count:
        raise validate.fail(
            owner, "minimum_distance", f"leave room for {count} points [length]", distance,
            f"only {len(points)} fitted: lower it or the count, or use sample.lattice",
        )  # fmt: skip
    return low + np.array(points).reshape(-1, 3)


def uniform_sphere(center: Any, radius: float, count: int, seed: int = 0) -> np.ndarray:
    """Points of equal volume in a ball, at random directions.

    The k-th point is at r = R ((k + 1/2) / n)^(1/3), the middle of the k-th shell of equal volume:
    the radial distribution is uniform to 1/n, without the noise of random radii. With
    :func:`stretch` it takes any other spherical profile.

    Args:
        center: Centre (3,) [length].
        radius: Radius R [length].
        count: Number of points n.
        seed: Seed of the directions.

    Returns:
        Points (count, 3) [length], from the centre outwards.
    """
    owner = "sample.uniform_sphere"
    middle = validate.vector(owner, "center", center, unit="length")
    radius = validate.number(owner, "radius", radius, above=0.0, unit="length")
    count = validate.whole(owner, "count", count)
    directions = _generator(owner, seed).normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    radii = radius * np.cbrt((np.arange(count) + 0.5) / max(count, 1))
    return middle + radii[:, None] * directions


def stretch(
    points: Any, center: Any, radius: float, density: Callable[[np.ndarray], Any]
) -> np.ndarray:
    """Move the points of a uniform ball along their radii so that they follow a density profile.

    A point keeps its mass coordinate, the share of the mass that lies closer to the centre:

        (r_0 / R)^3 = m(r) / m(R),    m(r) = integral_0^r rho(s) s^2 ds

    so particles of equal mass represent rho(r), whatever its normalisation. The error of r is about
    R / STRETCH_INTERVALS^2, also where rho goes to 0 at the surface.

    Args:
        points: Points (n, 3) [length] that fill the ball uniformly, as :func:`sphere` or
            :func:`uniform_sphere` make them.
        center: Centre of the ball (3,) [length].
        radius: Radius R of the ball, before and after [length].
        density: rho(r) for an array of radii in [0, R] [any unit]; not negative.

    Returns:
        Points (n, 3) [length], in the same order.

    Raises:
        ValueError: A point outside the ball; a density of another shape, not finite, negative or
            zero everywhere.

    Example:
        >>> ball = uniform_sphere((0, 0, 0), 1.0, 1000)
        >>> star = stretch(ball, (0, 0, 0), 1.0, lambda r: np.sinc(r))  # the polytrope n = 1
    """
    owner = "sample.stretch"
    rows = validate.rows(owner, "points", points, None, 3)
    middle = validate.vector(owner, "center", center, unit="length")
    radius = validate.number(owner, "radius", radius, above=0.0, unit="length")
    offsets = rows - middle
    old = np.linalg.norm(offsets, axis=1)
    if np.any(old > radius * (1 + 1e-6)):
        raise validate.fail(
            owner, "points", f"lie within {radius:g} of the center [length]", float(old.max()),
            "give the ball's own center and radius",
        )  # fmt: skip
    nodes, mass = _cumulative_mass(owner, radius, density)
    # The cube root of the mass coordinate is linear in r near the centre, so that linear
    # interpolation of its inverse is as good there as elsewhere.
    new = np.interp(old / radius, np.cbrt(mass), nodes)
    return middle + offsets * np.divide(new, old, out=np.zeros_like(old), where=old > 0)[:, None]


def maxwell_boltzmann(
    count: int,
    temperature: float,
    mass: Any,
    boltzmann: float = 1.0,
    seed: int = 0,
    remove_drift: bool = True,
) -> np.ndarray:
    """Velocities in thermal equilibrium: each component is normal with variance k T / m.

    Args:
        count: Number of particles n.
        temperature: T [temperature]; 0 gives particles at rest.
        mass: m, one for all or (n,) [mass].
        boltzmann: k [energy/temperature].
        seed: Seed.
        remove_drift: Subtract the centre of mass's velocity, so that the total momentum is zero.
            Then 3 n - 3 degrees of freedom carry k T / 2 each, and a single particle rests.

    Returns:
        Velocities (n, 3) [velocity].

    Raises:
        ValueError: A negative temperature, a mass or k that is not positive, masses of another
            number than ``count``.
    """
    owner = "sample.maxwell_boltzmann"
    count = validate.whole(owner, "count", count)
    temperature = validate.number(
        owner, "temperature", temperature, minimum=0.0, unit="temperature"
    )
    boltzmann = validate.number(owner, "boltzmann", boltzmann, above=0.0, unit="energy/temperature")
    masses = validate.rows(owner, "mass", mass, count, None)[:, None]
    if np.any(masses <= 0):
        raise validate.fail(
            owner, "mass", "be above 0 [mass]", float(masses.min()), "leave out pinned particles"
        )
    velocities = _generator(owner, seed).normal(size=(count, 3))
    velocities *= np.sqrt(boltzmann * temperature / masses)
    if remove_drift and count:
        velocities -= (masses * velocities).sum(axis=0) / masses.sum()
    return velocities


def _throw_darts(
    extent: np.ndarray, count: int, distance: float, periodic: bool, generator: np.random.Generator
) -> list[np.ndarray]:
    """Up to ``count`` points in [0, extent], none closer to another than ``distance``.

    Points are kept by cells at least as wide as the distance, so that a dart looks at 27 cells.
    """
    counts = np.maximum(1, np.floor(extent / distance)).astype(int)
    width = np.where(extent > 0, extent / counts, 1.0)
    steps = np.stack(np.meshgrid(*[(-1, 0, 1)] * 3), axis=-1).reshape(-1, 3)
    cells: dict[tuple[int, ...], list[np.ndarray]] = {}
    points: list[np.ndarray] = []
    misses = 0
    while len(points) < count and misses <= MISSES_ALLOWED:
        dart = generator.uniform(0.0, extent)
        cell = np.minimum((dart / width).astype(int), counts - 1)
        around = (cell + steps) % counts if periodic else cell + steps
        near = [other for key in around.tolist() for other in cells.get(tuple(key), ())]
        if near:
            gap = np.abs(np.array(near) - dart)
            gap = np.minimum(gap, extent - gap) if periodic else gap
            if (gap * gap).sum(axis=1).min() < distance * distance:
                misses += 1
                continue
        misses = 0
        cells.setdefault(tuple(cell.tolist()), []).append(dart)
        points.append(dart)
    return points


def _cumulative_mass(
    owner: str, radius: float, density: Callable[[np.ndarray], Any]
) -> tuple[np.ndarray, np.ndarray]:
    """Radii from 0 to R, and the share of the mass within each, from 0 to 1."""
    # Nodes crowd quadratically at the surface, where 1 - m goes like (R - r)^(n+1) for a density
    # that goes like (R - r)^n: then the error of linear interpolation is the same everywhere.
    nodes = radius * (1.0 - (1.0 - np.linspace(0.0, 1.0, STRETCH_INTERVALS + 1)) ** 2)
    abscissae, weights = np.polynomial.legendre.leggauss(4)
    half = np.diff(nodes)[:, None] / 2
    r = (nodes[:-1] + nodes[1:])[:, None] / 2 + half * abscissae
    rho = np.asarray(density(r.ravel()), dtype=np.float64)
    if rho.shape != (r.size,) and rho.shape != ():
        raise validate.fail(
            owner, "density", f"return shape ({r.size},) for that many radii", rho.shape,
            "compute with NumPy's functions",
        )  # fmt: skip
    rho = np.broadcast_to(rho, (r.size,)).reshape(r.shape)
    if not np.all(np.isfinite(rho)) or rho.min() < 0 or rho.max() == 0:
        raise validate.fail(
            owner, "density", "be finite, not negative, and somewhere positive", rho,
            f"check it on [0, {radius:g}]",
        )  # fmt: skip
    mass = np.concatenate([[0.0], np.cumsum((half * weights * rho * r * r).sum(axis=1))])
    return nodes, mass / mass[-1]


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


def _corners(owner: str, lower: Any, upper: Any) -> tuple[np.ndarray, np.ndarray]:
    low = validate.vector(owner, "lower", lower, unit="length")
    high = validate.vector(owner, "upper", upper, unit="length")
    if np.any(high < low):
        raise validate.fail(
            owner, "upper", f"be at least lower {low.tolist()} [length]", high, "swap the corners"
        )
    return low, high


def _generator(owner: str, seed: int) -> np.random.Generator:
    return np.random.default_rng(validate.whole(owner, "seed", seed))


def _jitter(
    owner: str, shape: tuple[int, ...], spacing: float, jitter: float, seed: int
) -> np.ndarray:
    generator = _generator(owner, seed)
    jitter = validate.number(owner, "jitter", jitter, minimum=0.0, maximum=0.5)
    return generator.uniform(-jitter, jitter, shape) * spacing
