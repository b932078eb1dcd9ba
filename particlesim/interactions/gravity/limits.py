"""What limits the step of gravity: tides, orbits and passages."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...engine.limit import Limit
from ...engine.probe import Probe

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
        rows = part.members[probe.model.world_of[part.members] == w]
        if 2 <= len(rows) <= MOST:
            found += _of_world(part, peer, probe, w, rows)
    return [min(found, key=lambda limit: limit.dt)] if found else []


def _of_world(part: Any, peer: Any, probe: Probe, w: int, rows: np.ndarray) -> list[Limit]:
    G, s = peer.parameters["constant"], softenings(part, peer, probe, rows)
    m, x, v = probe.mass[rows], probe.position[rows], probe.velocity[rows]
    free = probe.inverse_mass[rows] > 0
    length = probe.model.box_length[w]
    images = np.divide(1.0, length, out=np.zeros(3), where=length > 0)
    x_ij = x[None] - x[:, None]
    x_ij -= length * np.round(x_ij * images)
    r2 = (x_ij**2).sum(axis=2) + 0.5 * (s[None] ** 2 + s[:, None] ** 2)
    np.fill_diagonal(r2, np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        pull = G * m[None, :] / r2
        # Coincident bodies do not pull each other; their next approach is not to be foreseen.
        j = np.argmax(np.where(np.isfinite(pull), pull, 0.0), axis=1)
        i = np.arange(len(rows))
        acceleration = pull[:, :, None] * x_ij / np.sqrt(r2)[:, :, None]
        acceleration[~np.isfinite(acceleration)] = 0.0
        total = acceleration.sum(axis=1)
        d, u, mu = x_ij[j, i], v[i] - v[j], G * (m[i] * free[j] + m[j] * free[i])
        r = np.linalg.norm(d, axis=1)
        own = acceleration[i, j] - acceleration[j, i]
        tide = (total[i] - total[j]) - own
        energy = 0.5 * (u**2).sum(axis=1) - mu / r
        p = (np.cross(d, u) ** 2).sum(axis=1) / mu
        e = np.sqrt(np.maximum(0.0, 1.0 + 2.0 * energy * p / mu))
        closest, s = np.minimum(p / (1.0 + e), r), np.sqrt(0.5 * (s[i] ** 2 + s[j] ** 2))
        omega = np.sqrt(mu) / (closest**2 + s**2) ** 0.75
        alone = np.linalg.norm(tide, axis=1) < np.linalg.norm(own, axis=1)
        coming = ((d * u).sum(axis=1) < 0) | (energy < 0)
        if probe.settings.adaptive:  # a frame is asked for what it meets, at most as fast as there
            coming &= (r - closest) * closest < np.sqrt(mu * p) * probe.settings.dt
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
    """The heaviest two at the least softening length's depth: omega^2 = G (m_i + m_j) / s^3."""
    found = []
    for w, peer in enumerate(part.peers):
        members = part.members[probe.model.world_of[part.members] == w]
        s = softenings(part, peer, probe, members).min(initial=np.inf)
        G = abs(peer.parameters["constant"])
        mass = np.sort(probe.mass[members])[-2:]
        if s > 0 and G > 0 and len(mass) == 2:
            omega = float(np.sqrt(G * mass.sum() / s**3))
            reason = f"2 / omega, omega = {omega:.4g} /s = sqrt(G (m_i + m_j) / softening^3)"
            found.append(Limit(part.name, "passage", 2.0 / omega, reason, w))
    return [min(found, key=lambda limit: limit.dt)] if found else []


def orbits(part: Any, probe: Probe) -> list[Limit]:
    """The fastest orbit within a node of the tree, or of two bodies in a leaf.

    omega^2 = G M / (R^2 + s^2)^(3/2) with a node's mass and size, or G (m_i + m_j) /
    (r^2 + s^2)^(3/2). The answer of the force to small changes, by which the sum over all pairs is
    judged, is not that of a tree: it jumps by the tree's error where a cell is opened.
    """
    part.sums.build(probe.state)
    found = []
    for w, peer in enumerate(part.peers):
        G = abs(peer.parameters["constant"])
        rates = [part.sums.nodes(w), part.sums.couples(w)]
        with np.errstate(all="ignore"):
            omega2 = np.concatenate([G * mass / square**1.5 for mass, square in rates])
        omega2 = omega2[np.isfinite(omega2)]
        if len(omega2) and omega2.max() > 0:
            omega = float(np.sqrt(omega2.max()))
            reason = f"2 / omega, omega = {omega:.4g} /s of the fastest orbit in a node of the tree"
            found.append(Limit(part.name, "orbit", 2.0 / omega, reason, w))
    return [min(found, key=lambda limit: limit.dt)] if found else []


def softenings(part: Any, peer: Any, probe: Probe, rows: np.ndarray) -> np.ndarray:
    """The softening length of each of these particles of a world."""
    if part.own_softening:
        return np.asarray(probe.state["softening"].numpy()[rows], float)
    return np.full(len(rows), peer.parameters["softening"])
