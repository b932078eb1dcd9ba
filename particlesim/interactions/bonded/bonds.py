"""Bonds of any law of their length."""

from __future__ import annotations

from types import MappingProxyType
from typing import Any

import numpy as np

from ...kernels.interactions import coordinates
from ...kernels.interactions.calls import SQUARED
from .bonded import Bonded


class Bonds(Bonded):
    """Bonds by an energy law u(r, ...): the force along each is F = -du/dr, derived.

    Ends at one place are pushed apart, or held, along a fixed direction, equally and opposite.

    Args:
        pairs: (m, 2) indices of the ends.
        law: ``u(r, ...)`` [energy]. One whose first parameter is called ``distance_squared`` gets
            r^2, which saves a root; its force vanishes where the ends are at one place.
        **parameters: The law's further parameters, one for all or (m,) each; those not given are
            quantities of the first end (``charge_i``) and the second (``mass_j``).

    Raises:
        ValueError: Wrong shapes, ends that are the same, a parameter that is missing.
        TypeError: A parameter that the law does not have.

    Example:
        >>> import warp as wp
        >>> from particlesim import law
        >>> @law
        ... def morse(r: float, depth: float, width: float, rest: float):
        ...     return depth * (1.0 - wp.exp(-width * (r - rest))) ** 2.0
        >>> Bonds([(0, 1), (1, 2)], morse, depth=[1.0, 2.0], width=2.0, rest=1.0).pairs.shape
        (2, 2)
    """

    argument, size = "pairs", 2
    coordinate = coordinates.length
    by_name = MappingProxyType({SQUARED: coordinates.length_squared})

    pairs: np.ndarray

    def __init__(self, pairs: Any, law: Any, **parameters: Any) -> None:
        super().__init__(law, pairs, parameters)

    def links(self) -> np.ndarray:
        """Pairs to draw, (m, 2) indices in the scene."""
        return self.pairs
