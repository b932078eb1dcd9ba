"""How a sweep goes over tuples: one colour after the other, or all of them at once."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ...engine.execution.launch import launch
from ...kernels.constraints.constraints import Solved, positions_type
from ...kernels.constraints.projection import BLOCK, project_kernel
from ...kernels.constraints.solving import jacobi
from ...kernels.constraints.solving.unmet import unmet_kernel
from ...kernels.engine.sweeps import multipliers_kernel


class Solver:
    """Solves the tuples of a constraint, sweep by sweep.

    Args:
        constraint: Attached, with its tuples, their ``struct`` and the ``bodies``.
        solved: What its kernels are made for.
    """

    def __init__(self, constraint: Any, solved: Solved):
        self.constraint, self.model, self.solved = constraint, constraint.model, solved
        if self.model.settings.acceleration:
            lam = constraint.struct.lam
            self.last, self.before = wp.zeros_like(lam), wp.zeros_like(lam)

    def sweep(self, scale: float, dt: float, inverse_dt: float) -> None:
        """Once over all tuples; a ``scale`` of at least 0 begins a substep."""
        raise NotImplementedError

    def go_on(self, count: wp.array, omega: wp.array) -> None:
        """Multipliers go on as positions do."""
        kernel = multipliers_kernel(self.model.precision, self.solved.one_sided)
        inputs = [count, omega, self.last, self.before, self.constraint.struct.lam]
        launch(kernel, self.constraint.count, inputs, self.model.device)

    def look(self, flag: wp.array, tolerance: float) -> None:
        """Set the flag if a tuple is off by more."""
        it = self.constraint
        inputs = [self.model.box, it.struct, it.bodies, tolerance, flag]
        launch(unmet_kernel(self.solved), it.count, inputs, self.model.device)


class GaussSeidel(Solver):
    """Tuples one after the other, those of one colour, which share no particle, at once."""

    def __init__(self, constraint: Any, solved: Solved):
        super().__init__(constraint, solved)
        self.kernel = project_kernel(solved, self.model.vectorised)
        self.block = BLOCK if self.model.vectorised else 1

    def sweep(self, scale: float, dt: float, inverse_dt: float) -> None:
        it = self.constraint
        for start, end in it.tuples.spans:
            inputs = [start, end, scale, self.model.box, it.struct, it.bodies, dt, inverse_dt]
            launch(self.kernel, end - start, inputs, self.model.device, self.block)


class Jacobi(Solver):
    """All tuples at once, each particle split among its own (Tonge et al. 2012).

    Stable however many tuples meet at a particle, and independent of their order; it comes closer
    by less in a sweep than :class:`GaussSeidel`.
    """

    def __init__(self, constraint: Any, solved: Solved):
        super().__init__(constraint, solved)
        tuples, precision = constraint.tuples, self.model.precision
        ways = np.bincount(tuples.particles.ravel(), minlength=self.model.particle_count)
        self.share = self.model.array(ways[tuples.particles], precision.vector(tuples.size))
        rows = positions_type(precision, tuples.size)
        self.step = wp.zeros(tuples.count, dtype=rows, device=self.model.device)
        self.step_kernel = jacobi.step_kernel(solved)
        self.gather_kernel = jacobi.gather_kernel(solved)

    def sweep(self, scale: float, dt: float, inverse_dt: float) -> None:
        it, model = self.constraint, self.model
        inputs = [scale, model.box, it.struct, it.bodies, self.share, self.step, dt, inverse_dt]
        launch(self.step_kernel, it.count, inputs, model.device)
        seats = it.tuples.seats
        launch(self.gather_kernel, len(seats.particle), [seats, self.step, it.bodies], model.device)


SOLVERS: dict[str, type[Solver]] = {"gauss_seidel": GaussSeidel, "jacobi": Jacobi}
