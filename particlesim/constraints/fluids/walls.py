"""Boundaries as what holds a fluid's density up."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ...engine.execution.launch import launch
from ...engine.model import Model
from ...engine.state import State
from ...interactions.fluid.smoothing.smoothing_function import Smoothing
from ...kernels.constraints.fluids import walls as kernels
from ...kernels.interactions.fluid.walls import Surface

FINE = 8  # steps of the integrals between two nodes of the table


class Beyond:
    """The boundaries that hold particles of a fluid, beyond which the fluid goes on at rest.

    Args:
        fluid: A ``FluidDensity`` that is prepared.
        model: Its worlds.
    """

    def __init__(self, fluid: Any, model: Model):
        self.fluid, self.model = fluid, model
        kinds = zip(*(scene.constraints for scene in model.scenes), strict=True)
        solid = [peers[0].bind(peers) for peers in kinds if peers[0].solid]
        self.held = list[tuple[Any, np.ndarray]]()
        for part in solid:
            members = model.members([peer.group for peer in part.peers], part.name)
            flags = np.zeros(model.particle_count, dtype=np.int32)
            flags[np.intersect1d(members, fluid.members)] = 1
            if flags.any():
                self.held.append((part, flags))

    def __bool__(self) -> bool:
        return bool(self.held)

    def attach(self, state: State) -> None:
        """Make the surfaces and the table of what they cut off."""
        model, fluid, precision = self.model, self.fluid, self.model.precision
        self.walls = [part.wall(model, state) for part, _ in self.held]
        self.flags = [model.array(flags, wp.int32) for _, flags in self.held]
        columns = np.stack(cut_off(fluid.smoothing, fluid.dimension), axis=1)
        self.table = model.array(columns, precision.vector(2))
        per_length = kernels.NODES / fluid.cutoff
        self.nodes_per_length = model.array(per_length, precision.scalar)

    def close_in(self, data: Any, back: float) -> None:
        """What walls leave open of the surroundings of every particle."""
        model, fluid = self.model, self.fluid
        for wall, flags in zip(self.walls, self.flags, strict=True):
            wall.follow()
            surface = Surface(
                wall.facing, tuple(wall.places), max(wall.places) + 1, model.precision, wall.Params,
                len(wall.pose) > 0, False, fluid.dimension,
            )  # fmt: skip
            inputs = [fluid.pairs.pairs, wall.params, wall.pose, flags, self.table,
                      self.nodes_per_length, fluid.bodies, back, data]  # fmt: skip
            launch(kernels.wall_kernel(surface), fluid.count, inputs, model.device)


def cut_off(smoothing: Smoothing, dimension: int) -> tuple[np.ndarray, np.ndarray]:
    """P(t), what a plane at distance t h cuts off of W, and -dP/dt, at the nodes of a table.

    -dP/dt is the integral of W over the plane: w(t) on a line, 2 int w(sqrt(t^2 + y^2)) dy in the
    plane, 2 pi int w(q) q dq from t in space. P is the integral of that from t, 1/2 at the wall.
    """
    t = np.linspace(0.0, smoothing.support, kernels.NODES * FINE + 1)
    if dimension == 1:
        f = smoothing.at(t)
    elif dimension == 3:
        f = 2.0 * np.pi * _from_here(smoothing.at(t) * t, t)
    else:
        y = t[None, :: FINE // 2]
        f = 2.0 * np.trapezoid(smoothing.at(np.sqrt(t[:, None] ** 2 + y**2)), y, axis=1)
    f = smoothing.sigma * f
    P = _from_here(f, t)
    P *= 0.5 / P[0]
    return P[::FINE], f[::FINE]


def _from_here(f: np.ndarray, t: np.ndarray) -> np.ndarray:
    """int f dt from each t on."""
    panels = 0.5 * (f[1:] + f[:-1]) * np.diff(t)
    return np.append(np.cumsum(panels[::-1])[::-1], 0.0)
