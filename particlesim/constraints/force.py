"""A constraint as a force instead of a displacement."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from .. import validate
from ..engine.execution.launch import launch
from ..engine.model import Model
from ..engine.neighbors.lists import Neighbors
from ..engine.state import State
from ..kernels.constraints import constraint_force as kernels
from ..scene.part import Interaction
from .tuples import Tuples, bodies


class ConstraintForce(Interaction):
    """f_a = -grad_a C (C / alpha + beta dC/dt): a constraint's law as a penalty force.

    The energy is C^2 / (2 alpha). Unlike the constraint it adds no numerical damping, and needs
    dt below 2 sqrt(alpha / sum w |grad C|^2). With ``inequality`` it acts while C < 0.

    Args:
        constraint: Whose law, tuples and parameters to take; made by its ``as_force()``.

    Raises:
        ValueError: A compliance of 0; a ``break_force``; a yield.

    Example:
        >>> from particlesim import Distance
        >>> Distance([(0, 1)], rest_length=1.0, compliance=1e-3).as_force().links().tolist()
        [[0, 1]]
    """

    requires = frozenset({"force"})
    follows_box = True
    reads_velocity = True  # whatever the damping of a world is: worlds go as they go alone

    def __init__(self, constraint: Any):
        self.constraint = constraint
        alpha = constraint.compliance
        if alpha.size and not alpha.min() > 0:
            raise validate.fail(
                f"{constraint.name}.as_force", f"compliance[{int(np.argmin(alpha))}]",
                "be above 0", float(alpha.min()), "its force would be infinite: use the constraint",
            )  # fmt: skip
        if constraint.breakable:
            raise validate.fail(
                f"{constraint.name}.as_force", "break_force", "be None", constraint.break_force,
                "only the constraint itself breaks",
            )  # fmt: skip
        if getattr(constraint, "plastic", False):
            raise validate.fail(
                f"{constraint.name}.as_force", f"yield_{constraint.yields_by}", "be None",
                constraint.yield_at, "only the constraint itself yields",
            )  # fmt: skip

    @property
    def depends_on_velocity(self) -> bool:
        return bool(self.tuples.damped)

    @property
    def name(self) -> str:
        return f"{self.constraint.name} as a force"

    def kind(self) -> tuple[Any, ...]:
        return (type(self), *self.constraint.kind())

    def links(self) -> np.ndarray:
        """Pairs to draw, (m, 2) indices in the scene."""
        return self.constraint.links()

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        self.model = model
        self.tuples = Tuples(self.name, model, [peer.constraint for peer in self.peers])
        self.conservative = not self.tuples.damped
        self.seats = self.tuples.seats
        self.count = len(self.seats.particle)

    def attach(self, model: Model, state: State) -> None:
        if not self.count:
            return
        constraint, tuples = self.constraint, self.tuples
        self.struct = tuples.struct()
        self.bodies = bodies(model, state)
        self.solved = tuples.solved(constraint, state)
        self.force_kernel = kernels.force_kernel(self.solved)

    def apply(self, state: State, neighbors: Neighbors, dt: float) -> None:
        if self.count:
            inputs = [self.seats, self.model.box, self.struct, self.bodies, state.force]
            launch(self.force_kernel, self.count, inputs, self.model.device)

    def complaint(self) -> str:
        """That places are too coarse for how far the particles of a tuple are from each other."""
        return self.tuples.complaint(self.name)

    def measure(self, state: State, energy: wp.array, virial: wp.array) -> None:
        self._measure(energy, virial, tensor=False)

    def measure_stress(self, state: State, energy: wp.array, stress: wp.array) -> bool:
        self._measure(energy, stress, tensor=True)
        return True

    def _measure(self, energy: wp.array, virial: wp.array, tensor: bool) -> None:
        if self.count:
            inputs = [self.seats, self.model.box, self.struct, self.bodies, energy, virial]
            kernel = kernels.measure_kernel(self.solved, tensor)
            launch(kernel, self.count, inputs, self.model.device)
