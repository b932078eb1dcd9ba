"""What every constraint shares: when it is called, and what it may keep between substeps."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..interactions.base import Bindable

if TYPE_CHECKING:
    import warp as wp

    from ..engine.model import Model
    from ..engine.neighbors.lists import Neighbors
    from ..engine.probing.probe import Probe
    from ..engine.state import State
    from ..instruments.stability.report import Limit


class ConstraintBase(Bindable):
    """Acts on positions after integration.

    In a substep: ``begin`` once, then ``project`` in each iteration, in turn with the other
    constraints, then, when the velocities have followed the projection, ``finish``. Corrections
    are added to ``state.position`` and, the same amount, to ``state.correction``.
    """

    requires: frozenset[str] = frozenset()
    model: Model  # once prepared

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        """Once: merge the worlds' tuples and parameters, request neighbours."""
        raise NotImplementedError

    def attach(self, model: Model, state: State) -> None:
        """Once, when all arrays exist."""

    def begin(self, state: State, neighbors: Neighbors, dt: float) -> None:
        """At the start of a substep's projection: launches only."""

    def project(self, state: State, neighbors: Neighbors, dt: float) -> None:
        """One sweep: launches only."""
        raise NotImplementedError

    def finish(self, state: State, neighbors: Neighbors, dt: float) -> None:
        """After the velocities have followed: restitution, breaking. Launches only."""

    def limits(self, probe: Probe) -> list[Limit]:
        """Bounds on the substep at the present state (see ``Simulation.stability``)."""
        return []

    def persistent(self) -> dict[str, wp.array]:
        """Arrays that outlive a substep, for snapshots and checkpoints."""
        return {}

    def readable(self) -> dict[str, wp.array]:
        """Arrays of the last substep that users can read something from, for checkpoints."""
        return {}

    def worlds(self, name: str, array: wp.array) -> np.ndarray | None:
        """The world of each row of one of these arrays; None: its rows are no world's own."""
        model = self.model
        if len(array) == model.particle_count:
            return model.world_of
        return np.arange(model.world_count) if len(array) == model.world_count else None

    def reset(self, worlds: Sequence[int]) -> None:
        """Forget what these worlds have left behind."""

    def placed(self, worlds: Iterable[int]) -> None:
        """Positions in these worlds were written from outside."""

    def shapes(self) -> list[dict[str, Any]]:
        """Static shapes to draw."""
        return []
