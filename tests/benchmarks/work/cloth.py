"""A cloth with both diagonals, hung by two corners."""

from __future__ import annotations

import numpy as np

import particlesim as ps

SPACING, MASS, COMPLIANCE, GRAVITY = 0.01, 2e-5, 1e-7, 9.81  # [m], [kg], [m/N], [m/s^2]
SETTINGS = ps.Settings(dt=1 / 60, substeps=10, execution="threads")


def knots(side: int):
    """Places of the knots, pairs that are tied, and which are pinned."""
    k = np.arange(side**2).reshape(side, side)
    ends = (
        (k[:-1], k[1:]), (k[:, :-1], k[:, 1:]),
        (k[:-1, :-1], k[1:, 1:]), (k[1:, :-1], k[:-1, 1:]),
    )  # fmt: skip
    pairs = np.concatenate([np.stack([a.ravel(), b.ravel()], axis=1) for a, b in ends])
    x = SPACING * np.stack([k // side, 0 * k, k % side], axis=-1).reshape(-1, 3)
    return x, pairs, np.isin(k.ravel(), (k[0, 0], k[0, -1]))


def cloth(side: int) -> ps.Scene:
    """The scene."""
    x, pairs, pinned = knots(side)
    scene = ps.Scene()
    scene.add_particles(x, mass=MASS, pinned=pinned)
    scene.add_interaction(ps.UniformGravity((0, -GRAVITY, 0)))
    scene.add_constraint(ps.Distance(pairs, compliance=COMPLIANCE))
    return scene
