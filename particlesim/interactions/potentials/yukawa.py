"""Yukawa's screened potential."""

from __future__ import annotations

from typing import Any

import warp as wp

from ... import validate
from ...scene.law import law
from ..pair import Pair


@law
def yukawa_potential(r: float, strength: float, screening: float):
    return strength * wp.exp(-r / screening) / r


class Yukawa(Pair):
    """u = A exp(-r / L) / r (Yukawa 1935): charges in a plasma or an electrolyte.

    Args:
        group: Which particles interact with each other; None: all. A list of groups, one a kind,
            where something goes by kinds.
        strength: A [energy length], positive where it repels; a number or (kinds, kinds).
        screening: L [length], above 0; likewise.
        cutoff: Distance beyond which there is no force [length]; None: all pairs.
        **options: ``truncation``, ``switch``, ``groups`` and ``exclude``, as of ``Pair``.

    Example:
        >>> Yukawa(strength=2.0, screening=0.5, cutoff=3.0).parameters
        {'strength': 2.0, 'screening': 0.5}
    """

    def __init__(
        self, group: Any = None, strength: Any = 1.0, screening: Any = 1.0, cutoff: Any = None,
        **options: Any,
    ):  # fmt: skip
        values = {
            "strength": validate.table(self.name, "strength", strength, unit="energy length"),
            "screening": validate.table(
                self.name, "screening", screening, above=0.0, unit="length"
            ),
        }
        super().__init__(yukawa_potential, None, group, cutoff, values, **options)
