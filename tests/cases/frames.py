"""Frames of reference: the same scene in other units, elsewhere, turned, mirrored or moving.

A frame maps what is given in plain numbers to what an observer of that frame would write down: a
point to ``length * R x + shift``, a velocity to ``R v length / time + boost``, and any other
quantity by its dimensions. A motion is right if it is the same in every frame, mapped.
"""

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Quantity:
    """A number or vector with its dimensions.

    dimensions: powers of length, mass and time. kind: ``"number"``; ``"signed"``, a number whose
    sign a mirror changes; ``"vector"``, which turns;
    ``"axial"``, which turns and keeps its sign where a mirror would change it; ``"velocity"``, to
    which a boost is added; ``"point"``, which is shifted; ``"corner"`` of a box along the axes.
    """

    value: object
    dimensions: tuple[float, float, float] = (0, 0, 0)
    kind: str = "number"


@dataclass(frozen=True)
class Frame:
    """An observer's units, origin, axes and velocity."""

    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0
    turn: np.ndarray = field(default_factory=lambda: np.eye(3))
    shift: np.ndarray = field(default_factory=lambda: np.zeros(3))
    boost: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def scale(self, dimensions):
        """What a quantity of these dimensions is multiplied with."""
        length, mass, time = dimensions
        return self.length**length * self.mass**mass * self.time**time

    def of(self, quantity):
        """The quantity as this observer writes it."""
        value = np.asarray(quantity.value, dtype=float)
        scaled = value * self.scale(quantity.dimensions)
        if quantity.kind in ("number", "signed"):
            if quantity.kind == "signed":
                scaled = scaled * np.sign(np.linalg.det(self.turn))
            return scaled.item() if scaled.ndim == 0 else scaled
        turned = scaled @ self.turn.T
        if quantity.kind == "axial":
            return turned * np.linalg.det(self.turn)
        if quantity.kind == "velocity":
            return turned + self.boost
        return turned + self.shift if quantity.kind in ("point", "corner") else turned

    def point(self, x, time=0.0):
        """Positions (n, 3) at a time of the plain frame."""
        moved = self.boost * time * self.time
        return self.of(Quantity(x, (1, 0, 0), "point")) + moved

    def velocity(self, v):
        """Velocities (n, 3)."""
        return self.of(Quantity(v, (1, 0, -1), "velocity"))


def rotation(axis, angle):
    """Right-handed rotation by an angle [rad] (Rodrigues)."""
    n = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    cross = np.cross(np.eye(3), n)
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


MIRROR = np.diag([-1.0, 1.0, 1.0])
ASKEW = rotation((1, 2, 3), 0.7)
QUARTER = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])  # about z, exactly
