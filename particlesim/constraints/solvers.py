"""How a sweep goes over tuples: one colour after the other, or all of them at once."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ..engine.execution.launch import launch
from ..kernels.constraints import jacobi
from ..kernels.constraints.constraints import Solved, positions_type
from ..kernels.constraints.projection import BLOCK, project_kernel


class GaussSeidel:
    """Tuples one after the other, those of one colour, which share no particle, at once.

    Args:
        constraint: Attached, with its tuples, their ``struct`` and the ``bodies``.
        solved: What its kernels are made for.
    """

    def __init__(self, constraint: Any, solved: Solved):
        self.constraint, self.model = constraint, constraint.model
        self.kernel = project_kernel(solved, self.model.vectorised)
        self.block = BLOCK if self.model.vectorised else 1

    def sweep(self, scale: float, dt: float, inverse_dt: float) -> None:
        """Once over all tuples; a ``scale`` of at least 0 begins a substep."""
        it = self.constraint
        for start, end in it.tuples.spans:
            inputs = [start, end, scale, self.model.box, it.struct, it.bodies, dt, inverse_dt]
            launch(self.kernel, end - start, inputs, self.model.device, self.block)


class Jacobi:
    """All tuples at once, each particle split among its own (Tonge et al. 2012).

    Stable however many tuples meet at a particle, and independent of their order; it comes closer
    by less in a sweep than :class:`GaussSeidel`.

    Args:
        constraint: Attached, with its tuples, their ``struct`` and the ``bodies``.
        solved: What its kernels are made for.
    """

    def __init__(self, constraint: Any, solved: Solved):
        self.constraint, self.model = constraint, constraint.model
        tuples, precision = constraint.tuples, self.model.precision
        ways = np.bincount(tuples.particles.ravel(), minlength=self.model.particle_count)
        self.share = self.model.array(ways[tuples.particles], precision.vector(tuples.size))
        rows = positions_type(precision, tuples.size)
        self.step = wp.zeros(tuples.count, dtype=rows, device=self.model.device)
        self.step_kernel = jacobi.step_kernel(solved)
        self.gather_kernel = jacobi.gather_kernel(solved)

    def sweep(self, scale: float, dt: float, inverse_dt: float) -> None:
        """Once over all tuples; a ``scale`` of at least 0 begins a substep."""
        it, model = self.constraint, self.model
        inputs = [scale, model.box, it.struct, it.bodies, self.share, self.step, dt, inverse_dt]
        launch(self.step_kernel, it.count, inputs, model.device)
        seats = it.tuples.seats
        launch(self.gather_kernel, len(seats.particle), [seats, self.step, it.bodies], model.device)


SOLVERS: dict[str, type[GaussSeidel | Jacobi]] = {"gauss_seidel": GaussSeidel, "jacobi": Jacobi}
