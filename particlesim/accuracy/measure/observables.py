"""What can be observed of a simulation by name, and how a function of one is read."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ... import validate

OWNER = "measure"


def energy(sim: Any) -> np.ndarray:
    """Kinetic and potential energy, (worlds,)."""
    return sim.diagnostics().energy


def kinetic(sim: Any) -> np.ndarray:
    """Kinetic energy K, (worlds,)."""
    return sim.diagnostics().kinetic


def potential(sim: Any) -> np.ndarray:
    """Potential energy, (worlds,)."""
    return sim.diagnostics().potential


def momentum(sim: Any) -> np.ndarray:
    """Size of the momentum, (worlds,)."""
    return np.linalg.norm(sim.diagnostics().momentum, axis=1)


def temperature(sim: Any) -> np.ndarray:
    """k T = 2 K / (3 n), n the particles that are not pinned, (worlds,) [energy]."""
    free = np.array([np.count_nonzero(~scene.pinned) for scene in sim.scenes])
    return 2.0 * sim.diagnostics().kinetic / (3.0 * np.maximum(free, 1))


def pressure(sim: Any) -> np.ndarray:
    """P = (2 K + sum r.F) / (3 V) in a periodic box (Clausius 1870), (worlds,)."""
    volume = sim.model.box_length.prod(axis=1)
    if not (volume > 0).all():
        raise validate.fail(
            OWNER, "observe", "be of a scene that is periodic on all axes", "pressure",
            "give a function of the simulation",
        )  # fmt: skip
    now = sim.diagnostics()
    return (2.0 * now.kinetic + now.virial) / (3.0 * volume)


READY: dict[str, Callable[[Any], np.ndarray]] = {
    "energy": energy, "kinetic": kinetic, "potential": potential, "momentum": momentum,
    "temperature": temperature, "pressure": pressure,
}  # fmt: skip


def observable(observe: Any) -> Callable[[Any], Any]:
    """The function that is given, or named."""
    if callable(observe):
        return observe
    return READY[validate.choice(OWNER, "observe", observe, READY)]


def read(observe: Callable[[Any], Any], sim: Any) -> np.ndarray:
    """What is observed now: a number of the simulation, (), or one a world, (worlds,)."""
    with np.errstate(all="ignore"):
        value = np.asarray(observe(sim), dtype=np.float64)
    if value.shape not in ((), (sim.world_count,)):
        raise validate.fail(
            OWNER, "observe", "return a number, or one a world", f"an array of {value.shape}",
            "have it return a float",
        )  # fmt: skip
    return value
