"""Particles that make stars: homogeneous balls and discs."""

import numpy as np

import particlesim as ps


def ball(count):
    """About the ``count`` points of an fcc lattice nearest to its centre, of unit volume radius."""
    constant = (16 * np.pi / 3 / count) ** (1 / 3)
    cells = int(np.ceil(2 / constant)) + 2
    x = ps.sample.lattice("fcc", (cells,) * 3, constant)
    x -= x.mean(axis=0)
    return innermost(x, count)


def disc(count):
    """The same of a triangular lattice in the plane."""
    side = np.sqrt(2 * np.pi / np.sqrt(3) / count)
    rows = np.arange(-count // 2, count // 2 + 1) if count < 40 else np.arange(-30, 31)
    i, j = np.meshgrid(rows, rows)
    x = np.stack([side * (i + j / 2), side * np.sqrt(3) / 2 * j, 0.0 * i], axis=-1).reshape(-1, 3)
    return innermost(x, count)


def innermost(x, count):
    """The nearest to the centre; those beyond the radius 1 on it."""
    x = x[np.argsort(np.linalg.norm(x, axis=1), kind="stable")[:count]]
    return x / np.maximum(np.linalg.norm(x, axis=1, keepdims=True), 1.0)
