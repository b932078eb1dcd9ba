"""Incident: one world that the watchdog found wrong, what did it, and what was done about it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .limits import ESCAPED, FAST, FINITE

WHAT = {
    FINITE: "position and velocity must stay finite{}",
    ESCAPED: "position must stay within the bounds of the scene and what its numbers resolve, {}",
    FAST: "velocity beyond {} must have a cause that finer substeps agree on",
}
DONE = {
    "stop": "stopped at the last good frame",
    "retry": "the frame was done again with {substeps} substeps",
    "freeze": "the world is frozen at its last good frame, until it is reset",
}


class SimulationError(RuntimeError):
    """A simulation that cannot go on, with the particle, world, time and cause in the message."""


class SimulationWarning(UserWarning):
    """A world went wrong and the simulation goes on: what ``sim.incidents`` has, as it happens."""


@dataclass(frozen=True)
class Incident:
    """What was wrong, with which particle, when, by what, and what became of it.

    kind: ``"not finite"``, ``"escaped"`` or ``"runaway"``. world, particle: who was the first;
    particle counts within the world. frame: how many were good before. start, stop: times of the
    frame [s]. substep: the first after which it was so, of ``of`` substeps, from 1; ``time``: at
    its end [s]. part: the interaction or constraint that did it; None: the motion itself.
    position, velocity: of the particle after that substep. limit: what it has passed, or why the
    part gave up. action:
    ``"stop"``, ``"retry"`` or ``"freeze"``; substeps: how many the frame was done with in the end.
    """

    kind: str
    world: int
    particle: int
    frame: int
    start: float
    stop: float
    substep: int
    of: int
    part: str | None
    position: tuple[float, float, float]
    velocity: tuple[float, float, float]
    limit: str
    action: str
    substeps: int

    @classmethod
    def of_saved(cls, saved: dict[str, Any]) -> Incident:
        """The incident of a checkpoint's header, which has lists for triples."""
        triples = {name: tuple(saved[name]) for name in ("position", "velocity")}
        return cls(**{**saved, **triples})

    @property
    def time(self) -> float:
        """When the substep ended [s]."""
        return self.start + (self.stop - self.start) * self.substep / self.of

    @property
    def found(self) -> str:
        """What was found, without what was done."""
        kinds = {"not finite": FINITE, "escaped": ESCAPED, "runaway": FAST}
        kind = kinds[self.kind]
        why = f" ({self.limit})" if self.limit and kind == FINITE else self.limit
        what = WHAT[kind].format(why)
        x, v = (np.array2string(np.array(each)) for each in (self.position, self.velocity))
        look = f"look at {self.part}, which did it" if self.part else "look at how fast it moves"
        return (
            f"Simulation: {what}, got x = {x}, v = {v} of particle {self.particle} in world "
            f"{self.world} between t = {self.start:g} and {self.stop:g}; use more substeps, or "
            f"{look} in substep {self.substep} of {self.of}, by t = {self.time:g}"
        )

    def __str__(self) -> str:
        return f"{self.found}; {DONE[self.action].format(substeps=self.substeps)}."
