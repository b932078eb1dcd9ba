"""Sweeps over the constraints of a substep: how many, in which order, and how far on each goes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ...kernels.engine.sweeps import enough_kernel, go_on_kernel, pace_kernel
from ...scene.constraint_base import ConstraintBase
from ..execution.acting import act
from ..execution.copies import zero
from ..execution.launch import launch, owner, repeat
from ..model import Model
from ..neighbors.lists import Neighbors
from ..observers import PROJECT, Observers
from ..state import State


class Sweeps:
    """Projects positions by all constraints in turn, however they were added by rank: what holds
    bodies together, then what keeps them apart, then boundaries, so that friction sees all others.

    With ``Settings.constraint_tolerance`` sweeps end when every tuple is met, in all worlds of a
    batch; with ``Settings.acceleration`` positions go on in the direction that sweeps have come.

    Args:
        model, state: Of the loop.
        constraints: As they were added.
    """

    def __init__(self, model: Model, state: State, constraints: Sequence[ConstraintBase]):
        self.model = model
        self.constraints = sorted(constraints, key=lambda each: each.rank)
        self.inner = [each for each in self.constraints if each.rank == 0]
        self.outer = [each for each in self.constraints if each.rank > 0]
        settings, device = model.settings, model.device
        self.rho, self.tolerance = settings.acceleration, settings.constraint_tolerance
        if not self.inner:
            self.rho = 0.0
        if self.tolerance is not None:
            self.sweeps, self.flag = (model.array(np.zeros(1), wp.int32) for _ in range(2))
        if self.rho:
            self.count, self.omega = (
                wp.zeros(1, dtype=kind, device=device) for kind in (wp.int32, wp.float64)
            )
            self.last, self.before = (wp.zeros_like(state.position) for _ in range(2))
            self.go_on_kernel = go_on_kernel(model.precision, "position_error" in state)
            error = state.position_error if "position_error" in state else self.last
            self.places = [self.last, self.before, state.position, error, state.correction]

    def act(
        self, observers: Observers, state: State, neighbors: Neighbors, dt: float, iterations: int
    ) -> None:
        """All that a substep makes of positions that have moved."""
        now = state, neighbors, dt
        for constraint in self.constraints:
            with owner(constraint.name):
                act(constraint, constraint.begin, *now)
        timed = 0 < dt < math.inf
        if self.rho and timed:
            zero(self.model, self.count)
        if self.tolerance is None or not timed:
            for _ in range(iterations):
                self._sweep(observers, now, timed)
            return
        zero(self.model, self.sweeps)
        self._sweep(observers, now, timed)
        self._look(iterations)
        with repeat(self.flag):
            self._sweep(observers, now, timed)
            self._look(iterations)

    def _sweep(self, observers: Observers, now: tuple[Any, ...], timed: bool) -> None:
        for constraint in self.inner:
            observers.act(constraint, PROJECT, constraint.project, *now)
        if self.rho and timed:
            self._go_on(observers)
        for constraint in self.outer:
            observers.act(constraint, PROJECT, constraint.project, *now)

    def _go_on(self, observers: Observers) -> None:
        """Positions and multipliers go on in the direction in which they have come."""
        with owner("acceleration"):
            launch(pace_kernel(), 1, [self.rho, self.count, self.omega], self.model.device)
            inputs = [self.count, self.omega, *self.places]
            launch(self.go_on_kernel, self.model.particle_count, inputs, self.model.device)
        for constraint in self.inner:
            with owner(constraint.name):
                act(constraint, constraint.go_on, self.count, self.omega)

    def _look(self, most: int) -> None:
        """Is one more due?"""
        zero(self.model, self.flag)
        for constraint in self.inner:
            with owner(constraint.name):
                act(constraint, constraint.look, self.flag, self.tolerance)
        launch(enough_kernel(), 1, [most, self.sweeps, self.flag], self.model.device)
