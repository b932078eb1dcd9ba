"""Observables: what is looked at of a simulation, by name or as a function."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import validate
from .one_world import worlds_of


def _of_box(name: str) -> Callable[[Any], Any]:
    """What the diagnostics tell of a box that has a volume."""

    def found(sim: Any) -> Any:
        box = sim.scenes[0].periodic
        if box is None or not all(box[2]):
            raise validate.fail(
                "observe", name, "be of a scene that is periodic on all axes", box,
                "give a function of the simulation",
            )  # fmt: skip
        return getattr(sim.diagnostics(), name)[0]

    return found


READY: dict[str, Callable[[Any], Any]] = {
    "position": lambda sim: sim.position,
    "velocity": lambda sim: sim.velocity,
    "energy": lambda sim: sim.diagnostics().energy[0],
    "kinetic": lambda sim: sim.diagnostics().kinetic[0],
    "potential": lambda sim: sim.diagnostics().potential[0],
    "momentum": lambda sim: sim.diagnostics().momentum[0],
    "angular_momentum": lambda sim: sim.diagnostics().angular_momentum[0],
    "virial": lambda sim: sim.diagnostics().virial[0],
    "temperature": lambda sim: sim.diagnostics().temperature[0],
    "pressure": _of_box("pressure"),
    "stress": _of_box("stress"),
}
PARTICLES = ("position", "velocity")  # one vector for each


@dataclass(frozen=True)
class Observable:
    """Something to look at.

    Args:
        name: As the words of reports have it.
        function: Of a simulation of one world; gives a number, or an array of any shape.
        particles: Whether it gives a vector for each particle.
        wrapped: Whether differences go the short way round a periodic box.
    """

    name: str
    function: Callable[[Any], Any]
    particles: bool = False
    wrapped: bool = False

    def __call__(self, sim: Any) -> list[np.ndarray]:
        """The values of every world, each an array of its own."""
        return [np.array(self.function(each)) for each in worlds_of(sim)]


def observable(owner: str, observe: Any) -> Observable:
    """A ready observable by its name, or one of a function of the simulation.

    Raises:
        ValueError: No such name. TypeError: Neither a name nor a function.
    """
    if isinstance(observe, str):
        validate.choice(owner, "observe", observe, READY)
        particles = observe in PARTICLES
        return Observable(observe, READY[observe], particles, wrapped=observe == "position")
    if not callable(observe):
        raise TypeError(
            f"{owner}: observe must be a function of the simulation or one of {', '.join(READY)}, "
            f"got {observe!r}; pass lambda sim: ..."
        )
    name = getattr(observe, "__name__", "")
    return Observable("values" if name in ("", "<lambda>") else name, observe)


def sizes(owner: str, name: Any) -> Callable[[Any], Any]:
    """A ready observable as one number a world, (worlds,), of vectors their size; or a function."""
    if callable(name):
        return name
    validate.choice(owner, "observe", name, [each for each in READY if each not in PARTICLES])
    seen = observable(owner, name)
    return lambda sim: np.array([np.linalg.norm(v) if v.ndim else v for v in seen(sim)])
