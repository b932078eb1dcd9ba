"""Plummer's sphere: a star cluster in equilibrium."""

from __future__ import annotations

from typing import Any

import numpy as np

from ... import validate
from .arrange import make_generator

SPEED_INTERVALS = 4096  # at which the distribution of speeds is tabulated


def plummer(center: Any, scale: float, count: int, seed: int = 0) -> np.ndarray:
    """Points of equal mass in Plummer's profile, at random directions.

    rho(r) = 3 M / (4 pi a^3) (1 + r^2 / a^2)^(-5/2) (Plummer 1911), so the mass within r is
    m(r) = M (1 + a^2 / r^2)^(-3/2). The k-th point is where m = (k + 1/2) M / n: the profile is met
    to 1/n, without the noise of random radii. Half the mass is within 1.3048 a; the outermost of
    many points is about sqrt(4 n / 3) a away.

    Args:
        center: Centre (3,) [length].
        scale: a, above 0 [length].
        count: Number of points n.
        seed: Seed of the directions.

    Returns:
        Points (count, 3) [length], from the centre outwards.
    """
    owner = "sample.plummer"
    middle = validate.vector(owner, "center", center, unit="length")
    scale = validate.number(owner, "scale", scale, above=0.0, unit="length")
    count = validate.whole(owner, "count", count)
    directions = _directions(make_generator(owner, seed), count)
    mass = (np.arange(count) + 0.5) / max(count, 1)
    return middle + directions * (scale / np.sqrt(mass ** (-2.0 / 3.0) - 1.0))[:, None]


def plummer_velocity(
    points: Any, center: Any, scale: float, mass: float = 1.0, G: float = 1.0, seed: int = 0
) -> np.ndarray:
    """Velocities with which a Plummer sphere stays as it is.

    At a random direction each, q = v / v_esc with v_esc^2 = 2 G M / sqrt(r^2 + a^2), and q with the
    density q^2 (1 - q^2)^(7/2) (Aarseth, Henon and Wielen 1974).

    Args:
        points: Points (n, 3) [length], of :func:`plummer`.
        center: Its centre (3,) [length].
        scale: Its a, above 0 [length].
        mass: Of all points together, at least 0 [mass].
        G: [length^3 / (mass time^2)].
        seed: Seed.

    Returns:
        Velocities (n, 3) [velocity].

    Example:
        >>> x = plummer((0, 0, 0), 1.0, 4000)
        >>> v = plummer_velocity(x, (0, 0, 0), 1.0)
        >>> (v**2).sum(axis=1).mean().round(2).item()  # twice the kinetic energy is 3 pi / 32
        0.29
    """
    owner = "sample.plummer_velocity"
    rows = validate.rows(owner, "points", points, None, 3)
    middle = validate.vector(owner, "center", center, unit="length")
    scale = validate.number(owner, "scale", scale, above=0.0, unit="length")
    mass = validate.number(owner, "mass", mass, minimum=0.0, unit="mass")
    G = validate.number(owner, "G", G, minimum=0.0)
    q = np.linspace(0.0, 1.0, SPEED_INTERVALS + 1)
    middles = 0.5 * (q[1:] + q[:-1])
    below = np.cumsum(middles**2 * (1.0 - middles**2) ** 3.5)
    generator = make_generator(owner, seed)
    share = generator.uniform(size=len(rows))  # first: else directions were those of the points
    q = np.interp(share, np.append(0.0, below / below[-1]), q)
    directions = _directions(generator, len(rows))
    r2 = ((rows - middle) ** 2).sum(axis=1)
    escape = np.sqrt(2.0 * G * mass / np.sqrt(r2 + scale**2))
    return directions * (q * escape)[:, None]


def _directions(generator: np.random.Generator, count: int) -> np.ndarray:
    directions = generator.normal(size=(count, 3))
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)
