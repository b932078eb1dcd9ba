"""A cold Plummer sphere of equal bodies, which falls in on itself; G = M = a = 1."""

from __future__ import annotations

import numpy as np

import particlesim as ps

SOFTENING, STEP = 0.02, 0.002
SETTINGS = ps.Settings(dt=STEP, substeps=1, integrator="velocity_verlet", execution="threads")
SLAB = 512  # bodies whose distances are held at once


def plummer(count: int) -> np.ndarray:
    """Places (Plummer 1911), within 95 % of the mass, (n, 3)."""
    rng = np.random.default_rng(0)
    r = (rng.uniform(0, 0.95, count) ** (-2 / 3) - 1) ** -0.5
    n = rng.normal(size=(count, 3))
    return r[:, None] * n / np.linalg.norm(n, axis=1)[:, None]


def bodies(count: int) -> ps.Scene:
    """The scene."""
    scene = ps.Scene()
    scene.add_particles(plummer(count), mass=1.0 / count)
    scene.add_interaction(ps.Gravity(G=1.0, softening=SOFTENING))
    return scene


def answers(x: np.ndarray, v: np.ndarray, softened: bool = True) -> dict[str, float]:
    """How fast the bodies fall inwards on average, linear in the forces, whom no close pair rules;
    and of those that are softened as ours the energy, with -sum of m^2 / sqrt(r^2 + s^2).
    """
    r = np.linalg.norm(x, axis=1)
    found = {"infall": -float(np.mean((v * x).sum(axis=1) / r))}
    if softened:
        found["energy"] = 0.5 * float((v**2).sum()) / len(x) + _potential(x)
    return found


def _potential(x: np.ndarray) -> float:
    total = 0.0
    for start in range(0, len(x), SLAB):
        d2 = ((x[start : start + SLAB, None] - x[None]) ** 2).sum(axis=2)
        each = 1.0 / np.sqrt(d2 + SOFTENING**2)
        total -= 0.5 * float(each[d2 > 0].sum())
    return total / len(x) ** 2
