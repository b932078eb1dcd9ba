"""A cold Plummer sphere of equal bodies, which falls in on itself; G = M = a = 1."""

from __future__ import annotations

import numpy as np

import particlesim as ps

SOFTENING, STEP = 0.02, 0.002
SETTINGS = ps.Settings(dt=STEP, substeps=1, integrator="velocity_verlet", execution="threads")
SLAB = 512  # bodies whose distances are held at once


def plummer(count: int) -> np.ndarray:
    """Places (Plummer 1911), within 95 % of the mass, (n, 3).

    A ball of a lattice, pulled out to the profile: no two bodies are so close that they would meet
    before the race is over, where those who do not soften would part from those who do.
    """
    cells = int(np.ceil(1.4 * np.cbrt(count)))
    sites = np.indices((cells,) * 3).reshape(3, -1).T - cells / 2 + (0.26, 0.13, 0.37)
    sites = sites[np.argsort((sites**2).sum(axis=1), kind="stable")[:count]]
    mass = 0.95 * (np.arange(count) + 0.5) / count
    r = (mass ** (-2 / 3) - 1) ** -0.5
    return sites * (r / np.linalg.norm(sites, axis=1))[:, None]


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
