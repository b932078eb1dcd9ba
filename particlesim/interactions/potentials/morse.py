"""Morse's potential of a bond that can break."""

from __future__ import annotations

from typing import Any

import warp as wp

from ... import validate
from ...scene.law import law
from ..pair import Pair


@law
def morse_potential(r: float, depth: float, steepness: float, distance: float):
    e = wp.exp(-steepness * (r - distance))
    return depth * e * (e - 2.0)


class Morse(Pair):
    """u = D (exp(-2 a (r - r0)) - 2 exp(-a (r - r0))), least at r0, where it is -D (Morse 1929).

    Args:
        group: Which particles interact with each other; None: all. A list of groups, one a kind,
            where something goes by kinds.
        depth: D [energy], at least 0; a number or (kinds, kinds).
        steepness: a [1/length], above 0; likewise.
        distance: r0 [length], above 0; likewise.
        cutoff: Distance beyond which there is no force [length]; None: all pairs.
        **options: ``truncation``, ``switch``, ``groups`` and ``exclude``, as of ``Pair``.

    Example:
        >>> Morse(depth=0.3429, steepness=1.3588, distance=2.866, cutoff=9.0).cutoff  # copper
        9.0
    """

    def __init__(
        self, group: Any = None, depth: Any = 1.0, steepness: Any = 1.0, distance: Any = 1.0,
        cutoff: Any = None, **options: Any,
    ):  # fmt: skip
        values = {
            "depth": validate.table(self.name, "depth", depth, minimum=0.0, unit="energy"),
            "steepness": validate.table(
                self.name, "steepness", steepness, above=0.0, unit="1/length"
            ),
            "distance": validate.table(self.name, "distance", distance, above=0.0, unit="length"),
        }
        super().__init__(morse_potential, None, group, cutoff, values, **options)
