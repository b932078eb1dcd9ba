"""Settings: every knob that trades speed for accuracy, and nothing about the scene itself."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

from . import validate

INTEGRATORS = ("symplectic_euler", "velocity_verlet")
PRECISIONS = ("float32", "float64")
EXECUTIONS = ("auto", "graph", "threads")


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How a scene is simulated. Frozen; :meth:`replace` makes a changed copy.

    Args:
        dt: Time of one frame, that is of one ``sim.step()`` [s].
        substeps: Substeps a frame; each advances by ``dt / substeps``.
        iterations: Sweeps over the constraints a substep (XPBD). Compliant constraints do not
            depend on it; stiff ones come closer to C = 0.
        integrator: ``"symplectic_euler"`` (first order, any scene) or ``"velocity_verlet"``
            (second order, scenes without constraints).
        precision: ``"float32"`` or ``"float64"``, in every kernel.
        skin: Added to the cutoff of neighbour lists [length]; they are rebuilt when a particle has
            moved half of it. Changes the cost, not the forces. None: 0.12 of the cutoff.
        compensated: Carry the rounding error of positions and velocities along (Kahan 1965), so
            that neither freezes where an increment is below the last bit.
        relaxation: Factor on averaged (Jacobi) contact corrections, above 0, at most 1: more would
            feed energy into stacks.
        depenetration_speed: Largest speed at which contacts push overlapping particles apart
            [length/s]. None: one radius a frame.
        execution: ``"graph"``, ``"threads"`` (CPU) or ``"auto"``, the faster as measured. Changes
            the cost, not one bit of the result.
        threads: CPU threads. None: as many as the process may use.

    Raises:
        ValueError: A value out of range. TypeError: An unknown knob; the message lists all.

    Example:
        >>> Settings(dt=1 / 60, substeps=20).replace(precision="float64").substeps
        20
    """

    dt: float = 1.0 / 60.0
    substeps: int = 10
    iterations: int = 1
    integrator: str = "symplectic_euler"
    precision: str = "float32"
    skin: float | None = None
    compensated: bool = True
    relaxation: float = 1.0
    depenetration_speed: float | None = None
    execution: str = "auto"
    threads: int | None = None

    def __new__(cls, *args: Any, **knobs: Any) -> Settings:
        validate.known("Settings", knobs, [f.name for f in dataclasses.fields(cls)], "knob")
        return super().__new__(cls)

    def __post_init__(self) -> None:
        owner = "Settings"
        checked: dict[str, Any] = {
            "dt": validate.number(owner, "dt", self.dt, minimum=0.0, unit="s"),
            "substeps": validate.whole(owner, "substeps", self.substeps, minimum=1),
            "iterations": validate.whole(owner, "iterations", self.iterations, minimum=1),
            "relaxation": validate.number(
                owner, "relaxation", self.relaxation, above=0.0, maximum=1.0
            ),
        }
        validate.choice(owner, "integrator", self.integrator, INTEGRATORS)
        validate.choice(owner, "precision", self.precision, PRECISIONS)
        validate.choice(owner, "execution", self.execution, EXECUTIONS)
        if self.skin is not None:
            checked["skin"] = validate.number(owner, "skin", self.skin, minimum=0.0, unit="length")
        if self.depenetration_speed is not None:
            checked["depenetration_speed"] = validate.number(
                owner, "depenetration_speed", self.depenetration_speed, above=0.0, unit="length/s"
            )
        if self.threads is not None:
            checked["threads"] = validate.whole(owner, "threads", self.threads, minimum=1)
        if not isinstance(self.compensated, bool):
            raise validate.fail(
                owner, "compensated", "be True or False", self.compensated, "choose one"
            )
        for name, value in checked.items():  # plain numbers, whatever kind was given
            object.__setattr__(self, name, value)

    @property
    def substep(self) -> float:
        """Time of one substep [s]."""
        return self.dt / self.substeps

    def replace(self, **knobs: Any) -> Settings:
        """A copy with some knobs changed."""
        validate.known("Settings", knobs, [f.name for f in dataclasses.fields(self)], "knob")
        return dataclasses.replace(self, **knobs)
