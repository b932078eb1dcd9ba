"""Random points, density profiles and velocities."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ... import validate
from .arrange import corners, make_generator

# Darts that miss in a row before a box counts as full.
MISSES_ALLOWED = 20_000
# Radii at which the mass coordinate is tabulated.
STRETCH_INTERVALS = 4096


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
    low, high = corners(owner, lower, upper)
    count = validate.whole(owner, "count", count)
    generator = make_generator(owner, seed)
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
    directions = make_generator(owner, seed).normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    radii = radius * np.cbrt((np.arange(count) + 0.5) / max(count, 1))
    return middle + radii[:, None] * directions


def stretch(
    points: Any, center: Any, radius: float, density: Callable[[np.ndarray], Any],
    dimension: int = 3,
) -> np.ndarray:  # fmt: skip
    """Move the points of a uniform ball along their radii so that they follow a density profile.

    A point keeps its mass coordinate, the share of the mass that lies closer to the centre:

        (r_0 / R)^d = m(r) / m(R),    m(r) = integral_0^r rho(s) s^(d-1) ds

    so particles of equal mass represent rho(r), whatever its normalisation. The error of r is about
    R / STRETCH_INTERVALS^2, also where rho goes to 0 at the surface.

    Args:
        points: Points (n, 3) [length] that fill the ball uniformly, as :func:`sphere` or
            :func:`uniform_sphere` make them.
        center: Centre of the ball (3,) [length].
        radius: Radius R of the ball, before and after [length].
        density: rho(r) for an array of radii in [0, R] [any unit]; not negative.
        dimension: d: 3; 2 for points that fill a disc, 1 for those of a line.

    Returns:
        Points (n, 3) [length], in the same order.

    Raises:
        ValueError: A point outside the ball; a density of another shape, not finite, negative or
            zero everywhere; another dimension.

    Example:
        >>> ball = uniform_sphere((0, 0, 0), 1.0, 1000)
        >>> star = stretch(ball, (0, 0, 0), 1.0, lambda r: np.sinc(r))  # the polytrope n = 1
    """
    owner = "sample.stretch"
    rows = validate.rows(owner, "points", points, None, 3)
    middle = validate.vector(owner, "center", center, unit="length")
    radius = validate.number(owner, "radius", radius, above=0.0, unit="length")
    if dimension not in (1, 2, 3):
        raise validate.fail(owner, "dimension", "be 1, 2 or 3", dimension, "choose one of these")
    offsets = rows - middle
    old = np.linalg.norm(offsets, axis=1)
    if np.any(old > radius * (1 + 1e-6)):
        raise validate.fail(
            owner, "points", f"lie within {radius:g} of the center [length]", float(old.max()),
            "give the ball's own center and radius",
        )  # fmt: skip
    nodes, mass = _cumulative_mass(owner, radius, density, dimension)
    # The d-th root of the mass coordinate is linear in r near the centre, so that linear
    # interpolation of its inverse is as good there as elsewhere.
    new = np.interp(old / radius, mass ** (1.0 / dimension), nodes)
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
    velocities = make_generator(owner, seed).normal(size=(count, 3))
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
    owner: str, radius: float, density: Callable[[np.ndarray], Any], dimension: int
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
    mass = np.concatenate(
        [[0.0], np.cumsum((half * weights * rho * r ** (dimension - 1)).sum(axis=1))]
    )
    return nodes, mass / mass[-1]
