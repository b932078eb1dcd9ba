"""Smoothing functions W(r, h): one class each, in files by family, and what ``SPH`` calls them."""

from __future__ import annotations

import math
from typing import Any

from .... import validate
from .gaussian import Gaussian
from .mueller import Poly6, Spiky
from .smoothing_function import Smoothing, SmoothingFunction
from .splines import CubicSpline, QuinticSpline
from .wendland import WendlandC2, WendlandC4, WendlandC6

SMOOTHING: dict[str, SmoothingFunction] = {
    "cubic_spline": CubicSpline(),
    "quintic_spline": QuinticSpline(),
    "wendland_c2": WendlandC2(),
    "wendland_c4": WendlandC4(),
    "wendland_c6": WendlandC6(),
    "gaussian": Gaussian(),
    "poly6": Poly6(),
    "spiky": Spiky(),
}


def summable(owner: str, given: Any, dimension: int) -> Smoothing:
    """A function, or that of a name, by which densities can be summed.

    Raises:
        TypeError: It is none. ValueError: No such name; or it is infinite at r = 0.
    """
    if isinstance(given, str):
        validate.choice(owner, "smoothing", given, SMOOTHING)
    function = SMOOTHING[given] if isinstance(given, str) else given
    if not isinstance(function, SmoothingFunction):
        raise TypeError(
            f"{owner}: smoothing must be a SmoothingFunction, got {given!r}; give WendlandC2()."
        )
    found = function.in_dimension(dimension)
    if not math.isfinite(found.center):
        raise validate.fail(
            owner, "smoothing", "be finite at r = 0, where densities count the particle itself",
            function.name, "give WendlandC2()",
        )  # fmt: skip
    return found
