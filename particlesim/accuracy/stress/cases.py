"""Cases: each knob at both ends of its range, and start states that are known to break programs."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...scene.settings import Settings
from ...simulation.simulation import Simulation

FAST, HEAVY = 30.0, 1000.0  # times the fastest particle; times the heaviest
FAR = 1e4  # times the size of the scene
NEAR = 1e-8  # of the distance of two particles


@dataclass(frozen=True)
class Case:
    """One extreme.

    Args:
        name: What it is, in a few words.
        knobs: Settings of the case, from the scene's own.
        disturb: Changes the start state through ``sim.set``; None: as the scene has it.
        comparable: A finer run of the same start shows what is right. Otherwise all that is asked
            is that the end is finite, or an error.
    """

    name: str
    knobs: Callable[[Settings], Settings] = lambda settings: settings
    disturb: Callable[[Simulation], None] | None = None
    comparable: bool = True


def cases(settings: Settings) -> list[Case]:
    """The cases of a scene with these settings; an extreme that it has already is left out."""
    return [*_steps(settings), *_knobs(settings), *_states()]


def _steps(settings: Settings) -> list[Case]:
    """The interval, from nothing to far past every limit. Those of one duration are comparable."""
    found = [
        Case("dt = 0", lambda s: s.replace(dt=0.0), comparable=False),
        Case("dt / 1e6", lambda s: s.replace(dt=s.dt * 1e-6), comparable=False),
        Case("dt x 1e6", lambda s: s.replace(dt=s.dt * 1e6, substeps=1), comparable=False),
        Case("substeps x 8", lambda s: s.replace(substeps=8 * s.substeps)),
    ]
    for part in (2, 4, 16):
        if settings.substeps // part > 1:
            found.append(Case(f"substeps / {part}", _knob("substeps", settings.substeps // part)))
    return [*found, Case("substeps = 1", lambda s: s.replace(substeps=1))]


def _knobs(settings: Settings) -> list[Case]:
    """All other knobs, at the ends of their ranges or at every choice."""
    ends = {
        "iterations": (1, 50),
        "integrator": ("symplectic_euler", "velocity_verlet"),
        "precision": ("float32", "float64"),
        "compensated": (False, True),
        "skin": (0.0, 1e-3, 1.0),
        "opening_angle": (0.0, 1.0),
        "relaxation": (0.05, 1.0),
        "depenetration_speed": (1e-6, 1e6),
        "execution": ("graph", "threads"),
        "threads": (1, 2 * (os.cpu_count() or 1)),
        "watchdog": (False, True),
        "on_failure": ("stop", "retry", "freeze"),
        "retries": (1, 12),
        "energy_growth": (1.5, 1e12),
        "ledger": (False, True),
        "safety": (0.01, 1.0),
    }
    return [
        Case(f"{name} = {value}", _knob(name, value))
        for name, values in ends.items()
        for value in values
        if value != getattr(settings, name)
    ]


def _knob(name: str, value: Any) -> Callable[[Settings], Settings]:
    return lambda settings: settings.replace(**{name: value})


def _states() -> list[Case]:
    """Start states. What is not a number must be refused; the others are compared."""
    return [
        Case("a position of NaN", disturb=_put("position", np.nan), comparable=False),
        Case("an infinite velocity", disturb=_put("velocity", np.inf), comparable=False),
        Case("a mass of zero", disturb=_put("mass", 0.0), comparable=False),
        Case("two particles in one place", disturb=lambda sim: _together(sim, 0.0)),
        Case("two particles almost in one place", disturb=lambda sim: _together(sim, NEAR)),
        Case(f"a particle {FAST:g} times as fast", disturb=_fast),
        Case(f"a particle {HEAVY:g} times as heavy", disturb=lambda sim: _heavy(sim, HEAVY)),
        Case(f"a particle {HEAVY:g} times as light", disturb=lambda sim: _heavy(sim, 1 / HEAVY)),
        Case("a particle far out", disturb=_far, comparable=False),
    ]


def _free(sim: Simulation) -> np.ndarray:
    """Particles that are not pinned."""
    return np.flatnonzero(np.concatenate([~scene.pinned for scene in sim.scenes]))


def _put(name: str, value: float) -> Callable[[Simulation], None]:
    def put(sim: Simulation) -> None:
        array = sim.get(name)
        array[len(array) // 2] = value
        sim.set(name, array)

    return put


def _together(sim: Simulation, fraction: float) -> None:
    """Two free particles, neighbours in number, at ``fraction`` of their distance."""
    free = _free(sim)
    if len(free) > 1:
        i, j = free[len(free) // 2 - 1 : len(free) // 2 + 1]
        x = sim.get("position")
        x[j] = x[i] + fraction * (x[j] - x[i])
        sim.position = x


def _fast(sim: Simulation) -> None:
    v, free = sim.get("velocity"), _free(sim)
    speed = np.linalg.norm(v, axis=1).max()
    # Where nothing moves yet: a hundredth of the scene's size a frame.
    typical = speed or 0.01 * _size(sim) / max(sim.settings.dt, 1e-30)
    if len(free):
        v[free[len(free) // 2]] = FAST * typical * np.array((0.6, 0.0, 0.8))
        sim.velocity = v


def _heavy(sim: Simulation, ratio: float) -> None:
    m, free = sim.get("mass"), _free(sim)
    if len(free):
        m[free[len(free) // 2]] *= ratio
        sim.set("mass", m)


def _far(sim: Simulation) -> None:
    x, free = sim.get("position"), _free(sim)
    if len(free):
        x[free[len(free) // 2]] += FAR * _size(sim)
        sim.position = x


def _size(sim: Simulation) -> float:
    x = sim.position
    return float(np.ptp(x, axis=0).max(initial=0.0)) or 1.0
