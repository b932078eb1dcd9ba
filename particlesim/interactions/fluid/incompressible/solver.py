"""The pressures of an incompressible fluid: two solves in every substep, and how well they went."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ....engine.blocks import blocks
from ....engine.execution.copies import copy
from ....engine.execution.launch import call, launch, repeat
from ....engine.model import Model
from ....engine.report import Solved
from ....engine.state import State
from ....kernels.interactions.fluid.incompressible import pressure as kernels
from ....kernels.interactions.fluid.incompressible import pressure_motion as motion
from .limits import first_step
from .passes import PressurePasses


class Solve:
    """One of both: what it starts from, and what it has come to.

    Args:
        model: Of the fluid.
        what: That is to be right.
        tolerance: Of its error, by which it ends.
        push: Part of what is denser than at rest that is pushed apart.
    """

    def __init__(self, model: Model, what: str, tolerance: float, push: float):
        self.model, self.what, self.tolerance, self.push = model, what, tolerance, push
        real, count, worlds = model.precision.scalar, model.particle_count, model.world_count
        self.warm, self.found = (model.array(np.zeros(count), real) for _ in range(2))
        self.error, self.error_told, self.missed = (
            model.array(np.zeros(worlds), wp.float64) for _ in range(3)
        )
        self.iterations, self.iterations_told = (
            model.array(np.zeros(worlds), wp.int32) for _ in range(2)
        )

    @property
    def told(self) -> dict[str, wp.array]:
        """What users can read of it."""
        return {
            f"{self.what}_error": self.error_told,
            f"{self.what}_iterations": self.iterations_told,
            f"{self.what}_missed": self.missed,
        }

    def iterated(self) -> Solved:
        """What it has come to."""
        error, iterations, missed = (each.numpy().copy() for each in self.told.values())
        return Solved(self.what, error, iterations, missed, self.tolerance)

    def go_on(self) -> None:
        """The next substep starts from what this one has found."""
        copy(self.model, self.found, self.warm)
        inputs = [self.error, self.iterations, self.tolerance, self.error_told,
                  self.iterations_told, self.missed]  # fmt: skip
        launch(motion.note_kernel(), self.model.world_count, inputs, self.model.device)


class PressureSolver:
    """Finds the pressures under which a fluid is neither compressed nor about to be.

    Args:
        fluid: A ``DFSPH``, attached.
    """

    def __init__(self, fluid: Any):
        self.fluid, model = fluid, fluid.model
        self.model, settings, device = model, model.settings, model.device
        self.divergence = Solve(model, "divergence", settings.divergence_tolerance, push=0.0)
        self.density = Solve(model, "density", settings.density_tolerance, push=1.0)
        self.solves = [self.divergence, self.density]
        self.passes = PressurePasses(fluid)
        pairs, precision = fluid.pairs, model.precision
        real, pair2 = precision.scalar, precision.vector(2)
        self.total, self.source, self.residual = (pairs.array(real) for _ in range(3))
        self.b, self.before = pairs.array(precision.vec3), pairs.array(pair2)
        offsets = np.append(pairs.begin_host, pairs.count)
        begin, end, world = blocks(offsets, kernels.BLOCK)
        edges = np.searchsorted(world, np.arange(model.world_count + 1))
        self.begin, self.end = model.array(begin, wp.int32), model.array(end, wp.int32)
        self.edge = model.array(edges, wp.int32)
        self.sums = wp.zeros(len(begin), dtype=wp.vec4d, device=device)
        self.first = model.array(self._first_steps(), wp.float64)
        self.omega = model.array(np.zeros(model.world_count), wp.float64)
        self.running = model.array(np.zeros(model.world_count), wp.int32)
        self.flag = wp.zeros(1, dtype=wp.int32, device=device)

    def solve(self, state: State, dt: float) -> None:
        """Add the force of pressures to those that there are."""
        fluid, count, precision = self.fluid, self.fluid.pairs.count, self.model.precision
        call(self.total.zero_)
        call(self.b.zero_)
        self.passes.sum_diagonal()
        self._solve(self.divergence, state, 0.0, dt)
        self._solve(self.density, state, dt, dt)
        inputs = [fluid.pairs.order, fluid.slot_state, self.b, state.force]
        self._launch(motion.force_kernel(precision), count, inputs)
        self.give(state)

    def _first_steps(self) -> np.ndarray:
        """omega of the first correction, by world."""
        fluid = self.fluid
        h, s = fluid.columns(["smoothing_length"])["smoothing_length"], fluid.spacings
        ratio = np.where(s > 0, h / np.where(s > 0, s, 1.0), 1.0)
        return np.array([first_step(fluid.smoothing, fluid.dimension, each) for each in ratio])

    def give(self, state: State) -> None:
        """Slots and particles get the pressures."""
        pairs = self.fluid.pairs
        inputs = [pairs.order, self.total, self.fluid.slot_state, state.pressure]
        self._launch(motion.pressure_kernel(self.model.precision), pairs.count, inputs)

    def recall(self, state: State) -> None:
        """Pressures that the state tells of are those that :meth:`give` gives."""
        pairs = self.fluid.pairs
        inputs = [pairs.order, state.density, state.pressure, self.total]
        self._launch(motion.recall_kernel(self.model.precision), pairs.count, inputs)

    def _solve(self, solve: Solve, state: State, ahead: float, dt: float) -> None:
        """One solve, at the velocities that forces have made ``ahead``."""
        fluid, passes, precision = self.fluid, self.passes, self.model.precision
        pairs, worlds = fluid.pairs, self.model.world_count
        foresee = motion.foresee_kernel(precision, passes.places)
        inputs = [pairs.order, pairs.fields["velocity"], state.force, state.inverse_mass, self.b,
                  passes.rate_at_walls, passes.normal, ahead, passes.u, passes.parting]  # fmt: skip
        self._launch(foresee, pairs.count, inputs)
        passes.sum_rate()
        inputs = [pairs.pairs, fluid.params, passes.rate, solve.warm, dt, solve.push,
                  fluid.slot_state, passes.k, self.source, self.before, self.running,
                  solve.iterations, self.flag]  # fmt: skip
        self._launch(kernels.begin_kernel(precision, fluid.Params), pairs.count, inputs)
        with repeat(self.flag):
            passes.answer()
            inputs = [self.begin, self.end, pairs.fields["mass"], passes.k, self.source,
                      passes.rate, passes.diagonal, self.before, self.residual, self.sums,
                      self.flag]  # fmt: skip
            self._launch(kernels.residual_kernel(precision), len(self.begin), inputs)
            inputs = [self.edge, self.begin, self.end, fluid.params, self.sums, dt, solve.tolerance,
                      self.model.settings.pressure_iterations, self.first, self.omega, solve.error,
                      self.running, solve.iterations, self.flag]  # fmt: skip
            self._launch(kernels.decide_kernel(fluid.Params), worlds, inputs)
            inputs = [pairs.pairs, self.running, self.omega, self.residual, passes.diagonal,
                      passes.k, self.before]  # fmt: skip
            self._launch(kernels.correct_kernel(precision), pairs.count, inputs)
        inputs = [pairs.order, passes.k, passes.a, solve.found, self.total, self.b]
        self._launch(motion.settle_kernel(precision), pairs.count, inputs)

    def _launch(self, kernel: wp.Kernel, rows: int, inputs: list[Any]) -> None:
        launch(kernel, rows, inputs, self.model.device)
