"""Angles between two bonds of a particle."""

from __future__ import annotations

from types import MappingProxyType
from typing import Any

import numpy as np

from ... import validate
from ...engine import topology
from ...kernels.interactions import coordinates
from ...scene.law import law
from .bonded import Bonded


class Angles(Bonded):
    """Angles by an energy law u(angle, ...), the angle at the middle particle, 0 to pi.

    It is taken from its sine and its cosine, so that it has all digits where it is straight or
    folded too, and forces are never more than |du/dangle| over the length of a leg. A law with a
    slope at pi, or at 0, has a kink there: at the very kink the force acts along a fixed direction
    across the legs, so that a chain that starts straight bends. A law of the cosine has none, and
    no force there. Legs of no length have no direction, and no force.

    Args:
        triples: (m, 3) indices, the middle particle in the middle.
        law: ``u(angle, ...)`` [energy], of the angle [rad]. One whose first parameter is called
            ``cosine`` gets its cosine, which is smooth everywhere and cheaper.
        **parameters: The law's further parameters, one for all or (m,) each; those not given are
            quantities of the three particles in their order (``charge_i``, ``mass_j``,
            ``charge_k``).

    Raises:
        ValueError: Wrong shapes, particles that are the same, a parameter that is missing.
        TypeError: A parameter that the law does not have.

    Example:
        >>> from particlesim import law
        >>> @law
        ... def stiff(cosine: float, stiffness: float):
        ...     return stiffness * (1.0 + cosine)
        >>> Angles([(0, 1, 2), (1, 2, 3)], stiff, stiffness=2.0).triples.shape
        (2, 3)
    """

    argument, size = "triples", 3
    coordinate = coordinates.angle
    by_name = MappingProxyType({"cosine": coordinates.cosine})

    triples: np.ndarray

    def __init__(self, triples: Any, law: Any, **parameters: Any) -> None:
        super().__init__(law, triples, parameters)


@law
def harmonic_angle(angle: float, stiffness: float, rest_angle: float):
    bend = angle - rest_angle
    return 0.5 * stiffness * bend * bend


class HarmonicAngles(Angles):
    """u = k (theta - theta_0)^2 / 2.

    Some force fields leave the half out: their k is half of this one.

    Args:
        triples: (m, 3) indices, the middle particle in the middle.
        stiffness: k [energy/rad^2], one or (m,), at least 0.
        rest_angle: theta_0 [rad], one or (m,), 0 to pi.

    Raises:
        ValueError: Wrong shapes, particles that are the same, values out of range.

    Example:
        >>> import math
        >>> HarmonicAngles([(0, 1, 2)], stiffness=50.0, rest_angle=math.radians(109.5)).links()
        array([], shape=(0, 2), dtype=int64)
    """

    def __init__(self, triples: Any, stiffness: Any, rest_angle: Any) -> None:
        super().__init__(triples, harmonic_angle, stiffness=stiffness, rest_angle=rest_angle)
        count = len(self.triples)
        topology.per_item(self.name, "stiffness", stiffness, count, minimum=0)
        angles = topology.per_item(self.name, "rest_angle", rest_angle, count, minimum=0)
        if angles.max(initial=0.0) > np.pi:
            at = int(np.argmax(angles))
            raise validate.fail(
                self.name, f"rest_angle[{at}]", "be at most pi [rad]", float(angles[at]),
                "give radians",
            )  # fmt: skip
