"""Access: positions and velocities of a simulation, or of one of its worlds, on the host."""

from __future__ import annotations

from typing import Any

import numpy as np


class Access:
    """Per-particle arrays by name: a member says which rows."""

    def get(self, name: str) -> np.ndarray:
        """A per-particle array, copied to the host."""
        raise NotImplementedError

    def set(self, name: str, value: Any) -> None:
        """Write a per-particle array; what was derived from it is forgotten."""
        raise NotImplementedError

    @property
    def position(self) -> np.ndarray:
        """Positions, (n, 3), a copy on the host; of all worlds, one after the other."""
        return self.get("position")

    @position.setter
    def position(self, value: Any) -> None:
        self.set("position", value)

    @property
    def velocity(self) -> np.ndarray:
        """Velocities, (n, 3), a copy on the host; of all worlds, one after the other."""
        return self.get("velocity")

    @velocity.setter
    def velocity(self, value: Any) -> None:
        self.set("velocity", value)
