"""Starts that do not fit the constraints: the first substep would turn the misfit into speed."""

from __future__ import annotations

import numpy as np

from ...constraints.constraint import Constraint
from ...engine.loop import Loop
from ...engine.probing.probe import Probe

MANY = 10.0  # times the speed that anything has, or gains in a frame
FEW = 1e-4  # of the size of the scene: what rounding and stretched springs may be off


def misfit(loop: Loop) -> str:
    """What is to be said of a start that violates constraints of tuples; empty if nothing is.

    A correction dx of the first substep becomes the speed dx / dt, the larger the finer the
    substep. It is said of the particle that gets most, if that is more than ten times what moves
    in the scene anyway. (Contacts and boundaries bring in what overlaps at a bounded speed.)
    """
    parts = [part for part in loop.constraints if isinstance(part, Constraint) and part.count]
    dt = loop.settings.substep
    if not parts or not dt > 0:
        return ""
    with Probe(loop) as probe:
        x, v, a = probe.position, probe.velocity, probe.acceleration
        usual = np.linalg.norm(v, axis=1).max() + loop.settings.dt * np.linalg.norm(a, axis=1).max()
        size = np.ptp(x, axis=0).max()
        for part in parts:
            part.begin(loop.state, loop.neighbors, dt)
            part.project(loop.state, loop.neighbors, dt)
            moved = np.linalg.norm(loop.get("position").astype(np.float64) - x, axis=1)
            row = int(np.argmax(moved))
            if moved[row] > FEW * size and moved[row] > MANY * usual * dt:
                world, particle = probe.place(row)
                where = f"particle {particle}" + (f" in world {world}" if world else "")
                return (
                    f"Simulation: the start must fit {part.name}, got {where} moved by "
                    f"{moved[row]:.3g} in the first substep, which gives it {moved[row] / dt:.3g} "
                    "length/s; call sim.project(iterations) first, or place it better."
                )
    return ""
