"""What tuples do to velocities, when these have followed the projection."""

from __future__ import annotations

from typing import Any

import warp as wp

from ...engine.execution.copies import zero
from ...engine.execution.launch import launch
from ...engine.integrators import method
from ...kernels.constraints.constraints import Solved
from ...kernels.constraints.solving.tuple_velocities import (
    bounce_kernel,
    damp_kernel,
    straighten_kernel,
)


class TupleVelocities:
    """Dampers, and bodies that hand on what some of their particles bounce off by.

    Args:
        constraint: Attached, with its tuples, their ``struct`` and the ``bodies``.
        solved: What its kernels are made for.
    """

    def __init__(self, constraint: Any, solved: Solved):
        self.constraint, self.model, self.solved = constraint, constraint.model, solved
        self.push: wp.array | None = None  # multipliers of a bounce; made where anything bounces

    def straighten(self, dt: float) -> None:
        """Where half a kick came since, what is rigid is not on its way to give in to it."""
        if method(self.model.settings).carries_forces:
            for _ in range(self.model.settings.iterations):
                self._sweep(straighten_kernel(self.solved), dt)

    def damp(self, dt: float) -> None:
        """f = -beta dC/dt grad C."""
        if self.constraint.tuples.damped:
            self._sweep(damp_kernel(self.solved), dt)

    def prepare_bounce(self) -> None:
        """No tuple has handed on anything yet."""
        if self.push is None:
            self.push = wp.zeros_like(self.constraint.struct.lam)
        zero(self.model, self.push)

    def bounce(self, bounces: Any, dt: float) -> None:
        """The change of velocities leaves the tuples as they are."""
        self._sweep(bounce_kernel(self.solved), dt, self.push, bounces, 1.0 / dt)

    def _sweep(self, kernel: wp.Kernel, *inputs: Any) -> None:
        it = self.constraint
        for start, end in it.tuples.spans:
            everything = [start, self.model.box, it.struct, it.bodies, *inputs]
            launch(kernel, end - start, everything, self.model.device)
