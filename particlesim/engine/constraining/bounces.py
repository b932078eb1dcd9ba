"""Bounces: restitution as impulses that go through whatever bodies the particles are part of."""

from __future__ import annotations

from collections.abc import Sequence

import warp as wp

from ...kernels.engine.bounces import bounces_type, decide_kernel
from ...scene.constraint_base import ConstraintBase
from ..execution.acting import act
from ..execution.copies import copy, zero
from ..execution.launch import launch, owner, repeat, when
from ..model import Model
from ..neighbors.lists import Neighbors
from ..observers import FINISH, Observers
from ..state import State


class Bounces:
    """Sweeps over velocities until what bounces off leaves as fast as it should.

    When the velocities have followed the projection, all constraints take turns, world by world:
    contacts and boundaries give impulses to what is too slow, and those that hold bodies together
    hand them on. Newton's law of impact for all contacts at once, with impulses that only push: at
    e = 1 it keeps the energy, whatever touches at the same time.

    Args:
        model, state: Of the loop.
        constraints: In the order of their sweeps over positions.
    """

    def __init__(self, model: Model, state: State, constraints: Sequence[ConstraintBase]):
        self.model = model
        # Impulses start where things meet, and go from there through the bodies.
        self.constraints = list(reversed(constraints))
        self.meeting = [each for each in self.constraints if each.bounces]
        if not self.meeting:
            return
        worlds, device = model.world_count, model.device
        self.struct = bounces_type(model.precision)()
        self.struct.before = wp.zeros_like(state.velocity)
        self.struct.running = wp.zeros(worlds, dtype=wp.int32, device=device)
        self.struct.again = wp.zeros(worlds, dtype=wp.int32, device=device)
        self.sweeps = wp.zeros(worlds, dtype=wp.int32, device=device)
        self.flag = wp.zeros(1, dtype=wp.int32, device=device)

    def act(self, observers: Observers, state: State, neighbors: Neighbors, dt: float) -> None:
        """What has met something bounces off, if anything does."""
        if not self.meeting or dt <= 0:
            return
        zero(self.model, self.sweeps)
        now = state, neighbors, self.struct, dt
        for each in self.meeting:
            observers.act(each, FINISH, each.start_bounce, *now)
        self._decide()
        with when(self.flag):
            copy(self.model, state.velocity, self.struct.before)
            for each in self.constraints:
                act(each, each.prepare_bounce, *now)
        with repeat(self.flag):
            for each in self.constraints:
                observers.act(each, FINISH, each.bounce, *now)
            self._decide()

    def _decide(self) -> None:
        with owner("bounces"):
            zero(self.model, self.flag)
            most = self.model.settings.bounce_iterations
            inputs = [most, self.struct.running, self.struct.again, self.sweeps, self.flag]
            launch(decide_kernel(), self.model.world_count, inputs, self.model.device)
