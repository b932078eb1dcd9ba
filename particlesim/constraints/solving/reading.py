"""What users read of constraints on tuples: their forces, and which are broken."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ...engine import topology
from ...scene.constraint_base import ConstraintBase
from ...scene.part import Part


class ReadTuples(ConstraintBase):
    """Base of :class:`~particlesim.constraints.constraint.Constraint`, which describes them."""

    count: int  # of tuples, in all worlds
    tuples: Any
    struct: Any
    strain: wp.array  # force of each tuple
    break_force: np.ndarray | None

    @property
    def breakable(self) -> bool:
        """Whether a tuple may be gone for good."""
        return self.break_force is not None

    def _strain(self, may_break: bool) -> None:
        """Evaluate the forces; what exceeds its limit may break."""
        raise NotImplementedError

    def read_force(self, part: Part) -> np.ndarray:
        if not self.count:
            return np.zeros(0)
        self._strain(may_break=False)
        return self._listed(self.strain.numpy(), part)

    def read_broken(self, part: Part) -> np.ndarray:
        if self.count and self.breakable:
            return self._listed(self.struct.broken.numpy(), part) > 0
        return self._listed(np.zeros(self.count), part) > 0

    def _listed(self, rows: np.ndarray, part: Part) -> np.ndarray:
        """Values of the sorted rows, of the worlds of ``part``, in the order of its tuples."""
        return topology.listed(rows, self.tuples.order, self.tuples.edges, self, part)

    @property
    def force(self) -> np.ndarray:
        """See ``Simulation.force``; only of ``sim.constraints``: a scene's may be in several."""
        if "peers" not in self.__dict__:
            raise self._elsewhere("force")
        return self.read_force(self)

    @property
    def broken(self) -> np.ndarray:
        """See ``Simulation.broken``; only of ``sim.constraints``, like :attr:`force`."""
        if "peers" not in self.__dict__:
            raise self._elsewhere("broken")
        return self.read_broken(self)
