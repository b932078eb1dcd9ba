"""Hinges of a sheet that go with its edges."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ...engine.execution.launch import launch
from ...kernels.constraints.kinds.tearing import SIDES, Sides, tear_kernel


class Tearing:
    """Which of the pairs that may tear are sides of each hinge.

    Args:
        hinges: Bound, with its ``struct``; those of a world go by the pairs of that world.
        edges: Bound, attached; a side that is no pair of it never tears.
    """

    def __init__(self, hinges: Any, edges: Any):
        self.hinges, self.edges, self.device = hinges, edges, hinges.model.device
        place = np.argsort(edges.tuples.order)  # of the n-th pair of all worlds
        rows = []
        for w, peer in enumerate(hinges.peers):
            pairs = np.sort(edges.peers[w].particles, axis=1).tolist()
            first = edges.tuples.edges[w]
            row = {tuple(pair): place[first + n] for n, pair in enumerate(pairs)}
            sides = np.sort(peer.particles[:, SIDES], axis=2).tolist()
            rows += [[row.get(tuple(side), -1) for side in five] for five in sides]
        listed = np.array(rows, dtype=np.int32)[hinges.tuples.order]
        self.side: wp.array = hinges.model.array(listed, Sides)

    def tear(self) -> None:
        """Hinges break of which a side is torn by now."""
        inputs = [self.side, self.edges.struct.broken, self.hinges.struct.broken]
        launch(tear_kernel(), self.hinges.count, inputs, self.device)
