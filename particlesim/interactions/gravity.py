"""Gravity between all pairs of particles."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from .. import validate
from ..engine.limit import Limit
from ..engine.probe import Probe
from ..scene.law import law
from .pair import Pair

MOST = 4096  # bodies of a world whose pairs are all looked at
HEAD_ON = 1e-6  # of their distance: a pericentre that counts as none
PHASE = 0.5  # omega dt at the pericentre; leapfrog's energy is off by about a third of its square


def closest_approach(part: Any, probe: Probe) -> list[Limit]:
    """The pericentre of every body around the one that pulls it most.

    Two bodies follow a conic while the tide of all others is less than what they pull each other
    with: r_p = p / (1 + e), p = h^2 / mu, e^2 = 1 + 2 E p / mu, mu = G (m_i + m_j). There
    omega^2 = mu / (r_p^2 + s^2)^(3/2), with the softening s. Counted are those that come closer, or
    are bound and will.
    """
    found = []
    for w, peer in enumerate(part.peers):
        rows = part.pairs.members_host[probe.model.world_of[part.pairs.members_host] == w]
        if 2 <= len(rows) <= MOST:
            found += _of_world(part, peer, probe, w, rows)
    return [min(found, key=lambda limit: limit.dt)] if found else []


def _of_world(part: Any, peer: Any, probe: Probe, w: int, rows: np.ndarray) -> list[Limit]:
    G, s = peer.parameters["constant"], peer.parameters["softening"]
    m, x, v = probe.mass[rows], probe.position[rows], probe.velocity[rows]
    free = probe.inverse_mass[rows] > 0
    x_ij = x[None] - x[:, None]
    r2 = (x_ij**2).sum(axis=2) + s**2
    np.fill_diagonal(r2, np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        pull = G * m[None, :] / r2
        # Coincident bodies do not pull each other; their next approach is not to be foreseen.
        j = np.argmax(np.where(np.isfinite(pull), pull, 0.0), axis=1)
        i = np.arange(len(rows))
        acceleration = pull[:, :, None] * x_ij / np.sqrt(r2)[:, :, None]
        acceleration[~np.isfinite(acceleration)] = 0.0
        total = acceleration.sum(axis=1)
        d, u, mu = x[i] - x[j], v[i] - v[j], G * (m[i] * free[j] + m[j] * free[i])
        r = np.linalg.norm(d, axis=1)
        own = acceleration[i, j] - acceleration[j, i]
        tide = (total[i] - total[j]) - own
        energy = 0.5 * (u**2).sum(axis=1) - mu / r
        p = (np.cross(d, u) ** 2).sum(axis=1) / mu
        e = np.sqrt(np.maximum(0.0, 1.0 + 2.0 * energy * p / mu))
        closest = np.minimum(p / (1.0 + e), r)
        omega = np.sqrt(mu) / (closest**2 + s**2) ** 0.75
        alone = np.linalg.norm(tide, axis=1) < np.linalg.norm(own, axis=1)
        coming = ((d * u).sum(axis=1) < 0) | (energy < 0)
    # Who falls straight on another meets what no step is small enough for.
    passing = closest**2 + s**2 > (HEAD_ON * r) ** 2
    ready = alone & coming & passing & (mu > 0) & (omega > 0)
    if not ready.any():
        return []
    k = int(np.argmax(np.where(ready, omega, 0.0)))
    reason = (
        f"{PHASE:g} / omega, omega = {omega[k]:.4g} /s at the pericentre {closest[k]:.4g} of the "
        f"orbit around particle {int(rows[j[k]] - probe.model.offsets[w])}"
    )
    dt = float(PHASE / omega[k]) if np.isfinite(omega[k]) else 0.0
    return [Limit(part.name, "approach", dt, reason, *probe.place(int(rows[k])))]


def closest_passage(part: Any, probe: Probe) -> list[Limit]:
    """The heaviest two at the softening length's depth: omega^2 = G (m_i + m_j) / s^3."""
    found = []
    for w, peer in enumerate(part.peers):
        members = part.pairs.members_host[probe.model.world_of[part.pairs.members_host] == w]
        s, G = peer.parameters["softening"], abs(peer.parameters["constant"])
        mass = np.sort(probe.mass[members])[-2:]
        if s > 0 and G > 0 and len(mass) == 2:
            omega = float(np.sqrt(G * mass.sum() / s**3))
            reason = f"2 / omega, omega = {omega:.4g} /s = sqrt(G (m_i + m_j) / softening^3)"
            found.append(Limit(part.name, "passage", 2.0 / omega, reason, w))
    return [min(found, key=lambda limit: limit.dt)] if found else []


@law
def gravity_potential(r: float, mass_i: float, mass_j: float, constant: float, softening: float):
    return -(constant * mass_i) * (mass_j / wp.sqrt(r * r + softening * softening))


@law
def gravity_force(r: float, mass_i: float, mass_j: float, constant: float, softening: float):
    # In an order that stays in single precision's range wherever the force does.
    d2 = r * r + softening * softening
    return -(constant * mass_i) * (mass_j / d2) * (r / wp.sqrt(d2))


class Gravity(Pair):
    """Newton's gravity between all pairs of a world, u = -G m_i m_j / sqrt(r^2 + s^2).

    Softened after Plummer (1911). Costs the square of the number of particles. In a periodic box it
    acts between nearest images only, which jump at half the box: a run warns of it.

    Args:
        group: Which particles attract each other; None: all.
        G: [length^3 / (mass time^2)].
        softening: s [length], at least 0.

    Example:
        >>> Gravity(G=1.0, softening=0.01).cutoff is None
        True
    """

    def __init__(self, group: Any = None, G: float = 1.0, softening: float = 0.0):
        values = {
            "constant": validate.number(self.name, "G", G),
            "softening": validate.number(
                self.name, "softening", softening, minimum=0.0, unit="length"
            ),
        }
        super().__init__(gravity_potential, gravity_force, group, None, values)

    def limits(self, probe: Probe) -> list[Limit]:
        """By the tide now, by orbits' pericentres, and by passages at the softening length."""
        limits = probe.response(self) + closest_passage(self, probe)
        return limits + closest_approach(self, probe)
