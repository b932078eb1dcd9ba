"""Finitely extensible bonds of coarse polymers."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine import topology
from ...engine.model import Model
from ...scene.law import law
from .bonds import Bonds


@law
def fene(r: float, stiffness: float, length: float):
    """Past its length a bond has no root: what comes of it is no number, and told as such."""
    s = r / length
    return -stiffness * length * length * wp.log(wp.sqrt(1.0 - s * s))


class FENEBonds(Bonds):
    """u = -k R^2 / 2 ln(1 - (r/R)^2), bonds that cannot be longer than R.

    Kremer and Grest (1990, eq. 3) take k = 30 epsilon / sigma^2 and R = 1.5 sigma, with a
    Lennard-Jones repulsion cut and shifted at 2^(1/6) sigma between all particles, bonded ones
    too: bonds are then 0.97 sigma long at T = 1.

    A bond that a run has made longer than R has no energy, and its force is not a number: the run
    stops with a :class:`~particlesim.SimulationError` that names the particle, the time and these
    bonds.

    Args:
        pairs: (m, 2) indices of the ends.
        stiffness: k [energy/length^2], one or (m,), at least 0.
        length: R [length], one or (m,), above 0; in a periodic scene at most half a box.

    Raises:
        ValueError: Wrong shapes, ends that are the same, values out of range. When a simulation is
            made, bonds that are R long or longer at the start.

    Example:
        >>> FENEBonds([(0, 1), (1, 2)], stiffness=30.0, length=1.5).links().tolist()
        [[0, 1], [1, 2]]
    """

    def __init__(self, pairs: Any, stiffness: Any = 30.0, length: Any = 1.5) -> None:
        super().__init__(pairs, fene, stiffness=stiffness, length=length)
        count = len(self.pairs)
        topology.per_item(self.name, "stiffness", stiffness, count, minimum=0)
        self._refuse(self.parameters["length"] <= 0.0, "be above 0 [length]")

    def items(self, model: Model, w: int) -> dict[str, np.ndarray]:
        most = self.parameters["length"]
        topology.rest_lengths(self.name, model, w, self.pairs, most, "length")
        start = topology.steps(model, w, self.pairs)[:, 0]
        self._refuse(start >= most, "be above the distance of the ends at the start [length]")
        return super().items(model, w)

    def _refuse(self, wrong: np.ndarray, condition: str) -> None:
        """Lengths that are wrong, by the first."""
        if wrong.any():
            at = int(np.argmax(wrong))
            raise validate.fail(
                self.name, f"length[{at}]", condition, float(self.parameters["length"][at]),
                "give a larger one, or start the ends closer",
            )  # fmt: skip
