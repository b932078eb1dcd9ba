"""Limits of an incompressible fluid: what bounds its step, and the steps of its solves."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from ....engine.limit import Limit
from ....engine.probe import Probe
from ..limits import WAVENUMBERS, acceleration_limit, transform
from ..smoothing.smoothing_function import Smoothing

FLOW = 0.4  # of a spacing that a particle may move


def flow_limits(part: Any, viscous: Any, probe: Probe) -> list[Limit]:
    """Those of a fluid without sound, at present speeds, accelerations and viscosities.

    - flow: 0.4 spacings over the speed, without walls of that in their world's mean motion;
    - acceleration: 0.25 sqrt(h / |a|) by all other forces: what pressures correct of densities
      in one step is the larger the shorter that is;
    - viscosity: by how the force of ``viscous``, an interaction, answers to velocities.
    """
    rows = part.pairs.members_host
    if not len(rows):
        return []
    world = probe.model.world_of[rows]
    spacing, limits = part.spacings[world], list[Limit]()
    moved = np.linalg.norm(probe.velocity[rows], axis=1)
    speed = moved if part.walls else probe.relative_speed(rows)
    k = int(np.argmax(speed / spacing))
    if speed[k] > 0:
        reason = f"{FLOW} s / v, s = {spacing[k]:.4g}, v = {speed[k]:.4g}"
        dt = FLOW * float(spacing[k] / speed[k])
        limits.append(Limit(part.name, "flow", dt, reason, *probe.place(int(rows[k]))))
    gamma = probe.damping(viscous) if part.viscosity else 0.0
    if gamma > 0:
        dt = probe.loop.integrator.largest_step(0.0, gamma)
        limits.append(Limit(part.name, "viscosity", dt, f"gamma = {gamma:.4g} /s"))
    others = [each for each in probe.loop.passes if not each.answers]
    a = probe.force(others)[rows] * probe.inverse_mass[rows, None]
    return limits + acceleration_limit(part, probe, part.smoothing_lengths(rows), a)


@functools.cache
def first_step(smoothing: Smoothing, dimension: int, ratio: float) -> float:
    """Of how densities answer to pressures, on a lattice: its diagonal over its largest eigenvalue.

    A wave of pressures is answered by (rho k W_hat)^2, and the diagonal is the mean of that over
    all waves: max (kappa W_hat)^2 and int (kappa W_hat)^2 d^d kappa / (2 pi)^d over (h / s)^d.

    Args:
        ratio: h over the spacing s.
    """
    answer = (WAVENUMBERS * transform(smoothing, dimension)) ** 2
    surface = {1: 2.0, 2: 2.0 * np.pi, 3: 4.0 * np.pi}[dimension] / (2.0 * np.pi) ** dimension
    mean = np.trapezoid(surface * WAVENUMBERS ** (dimension - 1) * answer, WAVENUMBERS)
    return float(min(1.0, mean / (answer.max() * ratio**dimension)))
