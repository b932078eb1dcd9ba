"""Tuples that yield: strained too far, they do not come back to what they were."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine import topology
from ...engine.execution.launch import launch
from ...engine.model import Model
from ...engine.neighbors.lists import Neighbors
from ...engine.state import State
from ...kernels.constraints.solving.plasticity import creep_kernel, follow_kernel
from ..constraint import Constraint


class Plastic(Constraint):
    """Base of constraints whose rest value q_0 flows once q is too far from it.

    Where |q - q_0| is beyond the yield y,

        dq_0/dt = creep (q - q_0 -+ y)

    (the solid of Bingham, 1922: a slider of strength y / alpha beside a dashpot, and a spring), no
    further than ``largest`` from where it began. Each substep takes the exact solution for the q
    that it ends with, so that no creep is too fast.
    """

    rest: str  # what q_0 is called
    yields_by = "strain"  # what yields: a part of q_0 at the start, or an "angle" itself
    yield_at: np.ndarray | None = None  # (m,); None: it never yields

    def _yields(self, limit: Any, creep: Any, largest: Any) -> None:
        """From here on it yields, unless the limit is None."""
        name, by, count = self.name, self.yields_by, len(self.particles)
        unit = "rad" if by == "angle" else ""
        self.creep = validate.number(name, "creep", creep, minimum=0.0, unit="1/time")
        self.largest = validate.number(name, f"largest_{by}", largest, minimum=0.0, unit=unit)
        if limit is None:
            return
        self.yield_at = topology.per_item(name, f"yield_{by}", limit, count, minimum=0)
        if count and not self.compliance.min() > 0:
            raise validate.fail(
                name, f"compliance[{int(np.argmin(self.compliance))}]",
                f"be above 0 with yield_{by}", float(self.compliance.min()),
                "a rigid one is never strained: give the compliance of the material",
            )  # fmt: skip

    @property
    def plastic(self) -> bool:
        return self.yield_at is not None

    @property
    def _sense(self) -> int:
        """The sign of q - q_0 in C."""
        return 1

    def kind(self) -> tuple[Any, ...]:
        return (*super().kind(), self.plastic)

    # The engine's side ------------------------------------------------------------------------

    def attach(self, model: Model, state: State) -> None:
        super().attach(model, state)
        if self.count and self.plastic:
            flow = np.concatenate([peer._flow(model, w) for w, peer in enumerate(self.peers)])
            model.fits(self.name, {self.rest: np.abs(flow[:, 0]) + flow[:, 3]})
            self.flow = model.array(flow[self.tuples.order], wp.vec4d)
            self.permanent = wp.zeros(self.count, dtype=wp.float64, device=model.device)
            self.follow_kernel = follow_kernel(model.precision, self.tuples.Item, self.rest)
            self.creep_kernel = creep_kernel(self.tuples.solved(self, state), self._sense)

    def _flow(self, model: Model, w: int) -> np.ndarray:
        """q_0 at the start, the yield, the creep and the largest change of world w, (m, 4)."""
        start = self.columns(model, w)[self.rest]
        whole = np.abs(start) if self.yields_by == "strain" else np.ones(len(start))
        limit, creep = np.asarray(self.yield_at), np.full(len(start), self.creep)
        return np.column_stack([start, limit * whole, creep, self.largest * whole])

    def begin(self, state: State, neighbors: Neighbors, dt: float) -> None:
        super().begin(state, neighbors, dt)
        if self.count and self.plastic:
            inputs = [self.flow, self.permanent, self.struct.item]
            launch(self.follow_kernel, self.count, inputs, self.model.device)

    def finish(self, state: State, neighbors: Neighbors, dt: float) -> None:
        super().finish(state, neighbors, dt)
        if self.count and self.plastic and 0 < dt < math.inf:  # outside of time nothing flows
            inputs = [self.model.box, self.struct, self.bodies, dt, self.flow, self.permanent]
            launch(self.creep_kernel, self.count, inputs, self.model.device)

    def persistent(self) -> dict[str, wp.array]:
        flows = self.count and self.plastic
        return super().persistent() | ({"permanent": self.permanent} if flows else {})
