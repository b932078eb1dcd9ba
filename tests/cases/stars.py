"""Particles that make stars: homogeneous balls and discs, and how to spread them."""

import numpy as np

import particlesim as ps


def ball(count):
    """About the ``count`` points of an fcc lattice nearest to its centre, of unit volume radius."""
    constant = (16 * np.pi / 3 / count) ** (1 / 3)
    cells = int(np.ceil(2 / constant)) + 2
    x = ps.sample.lattice("fcc", (cells,) * 3, constant)
    x -= x.mean(axis=0)
    return x[np.argsort(np.linalg.norm(x, axis=1), kind="stable")[:count]]


def disc(count):
    """The same of a triangular lattice in the plane."""
    side = np.sqrt(2 * np.pi / np.sqrt(3) / count)
    rows = np.arange(-count // 2, count // 2 + 1) if count < 40 else np.arange(-30, 31)
    i, j = np.meshgrid(rows, rows)
    x = np.stack([side * (i + j / 2), side * np.sqrt(3) / 2 * j, 0.0 * i], axis=-1).reshape(-1, 3)
    return x[np.argsort(np.linalg.norm(x, axis=1), kind="stable")[:count]]


def spread(x, dimension, mass_within):
    """Move the points of a homogeneous ball of radius 1 along their radii to another profile.

    ``mass_within(radius)`` is the mass fraction of the profile, from 0 to 1.
    """
    r = np.linalg.norm(x, axis=1)
    radius = np.linspace(0, 1, 4001)
    target = np.interp(np.minimum(r**dimension, 1), mass_within(radius), radius)
    return x * np.divide(target, r, out=np.ones_like(r), where=r > 0)[:, None]
