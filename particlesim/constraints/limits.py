"""Limits of constraints: speeds of contacts, and what is to be known where nothing limits."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..engine.limit import Limit
from ..engine.probe import Probe


def contact_limits(part: Any, probe: Probe) -> list[Limit]:
    """No particle may pass its own radius in a substep: v dt + a dt^2 <= R.

    Two that run into each other then come no further than to each other's middle, which contacts
    turn back; past it they miss each other. v in the frame of the world's mean velocity.
    """
    if not part.count:
        return []
    rows = part.pairs.members_host
    radius = probe.state.radius.numpy()[rows].astype(np.float64)
    return passing_limits(part.name, probe, rows[radius > 0], radius[radius > 0], "R")


def passing_limits(
    name: str, probe: Probe, rows: np.ndarray, lengths: np.ndarray, symbol: str
) -> list[Limit]:
    """No particle may go farther than its own length in a substep: v dt + a dt^2 <= that.

    Args:
        name: Of the part that asks.
        probe: What it asks.
        rows: Of its particles.
        lengths: Of each, above 0 [length].
        symbol: What a length is called.
    """
    if not len(rows):
        return []
    v, a = probe.relative_speed(rows), np.linalg.norm(probe.acceleration[rows], axis=1)
    with np.errstate(divide="ignore"):
        dt = 2.0 * lengths / (v + np.sqrt(v**2 + 4.0 * a * lengths))
    k = int(np.argmin(dt))
    if not np.isfinite(dt[k]):
        return []
    reason = (
        f"v dt + a dt^2 = {symbol}, {symbol} = {lengths[k]:.4g}, v = {v[k]:.4g}, a = {a[k]:.4g}"
    )
    return [Limit(name, "speed", float(dt[k]), reason, *probe.place(int(rows[k])))]


def crossing_limits(
    part: Any, probe: Probe, names: list[str], times: Callable[[Any, np.ndarray], np.ndarray]
) -> list[Limit]:
    """The shortest time that any particle takes to cross, at its velocity against the boundary's.

    Args:
        part: The boundary of all worlds.
        probe: What asks.
        names: What the k times of a particle are.
        times: Of one world's boundary and velocities (m, 3): the times, (m, k).
    """
    found = []
    members = part.held.particle.numpy()
    for w, peer in enumerate(part.peers):
        rows = members[probe.model.world_of[members] == w]
        if len(rows):
            time = float(probe.state.time.numpy()[w]) if part.moving else 0.0
            v = probe.velocity[rows] - peer.drift(time)
            with np.errstate(divide="ignore"):
                dt = times(peer, v)
            k, which = (int(each) for each in np.unravel_index(np.argmin(dt), dt.shape))
            if np.isfinite(dt[k, which]):
                reason = f"{names[which]}, v = {np.linalg.norm(v[k]):.4g}"
                place = probe.place(int(rows[k]))
                found.append(Limit(part.name, "speed", float(dt[k, which]), reason, *place))
    return [min(found, key=lambda limit: limit.dt)] if found else []


def constraint_limits(part: Any, probe: Probe) -> list[Limit]:
    """XPBD takes any step, and damps: E falls by 1 / (1 + omega^2 dt^2) a substep.

    For constraints whose gradients are unit vectors omega^2 = sum w / alpha is known; the time in
    which the stiffest one's energy falls to 1/e is told.
    """
    if not part.count:
        return []
    reason = "any: implicit"
    dt = probe.settings.substep
    if part.unit and dt > 0:
        w = probe.inverse_mass[part.tuples.particles].sum(axis=1)
        alpha = np.concatenate([peer.compliance for peer in part.peers])[part.tuples.order]
        soft = (alpha > 0) & (w > 0)
        if soft.any():
            omega = float(np.sqrt((w[soft] / alpha[soft]).max()))
            time = dt / math.log1p((omega * dt) ** 2)
            reason += (
                f"; at omega = {omega:.4g} /s this substep damps energy to 1/e in {time:.3g} s"
            )
        elif w.any():
            reason += "; rigid, so motion along it stops within a substep"
    return [Limit(part.name, "damping in time", math.inf, reason)]
