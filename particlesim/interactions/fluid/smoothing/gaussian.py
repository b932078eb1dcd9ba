"""The Gaussian, cut at three smoothing lengths."""

from __future__ import annotations

import math
from types import MappingProxyType

import warp as wp

from ....scene.law import law
from .smoothing_function import SmoothingFunction

LEFT = math.exp(-9.0)  # of the Gaussian at the cut


@law
def gaussian(q: float):
    """w = exp(-q^2) - exp(-9), down to zero."""
    return wp.max(wp.exp(-q * q) - LEFT, 0.0)


@law
def gaussian_slope(q: float):
    """w' / q = -2 exp(-q^2)."""
    return wp.where(q < 3.0, -2.0 * wp.exp(-q * q), 0.0)


@law
def gaussian_curvature(q: float):
    """w'' = (4 q^2 - 2) exp(-q^2)."""
    return wp.where(q < 3.0, (4.0 * q * q - 2.0) * wp.exp(-q * q), 0.0)


class Gaussian(SmoothingFunction):
    """The Gaussian w = exp(-q^2) within the support 3 h (Gingold and Monaghan 1977).

    What is left of it there, exp(-9), is subtracted, so that a particle's density does not jump as
    others come within reach, and it is normalised as it then is: W(0) is 0.2 % above that of the
    whole one in three dimensions. The density of a cubic lattice is right to 0.02 % from an h of
    one spacing on, for 3.4 times the neighbours of a function that ends at 2 h.

    Example:
        >>> round(Gaussian().in_dimension(1).sigma, 4)
        0.5644
    """

    weight, slope, curvature = gaussian, gaussian_slope, gaussian_curvature
    support = 3.0
    center = 1.0 - LEFT
    # 1 over the integral of the Gaussian within 3, less that of what is subtracted.
    sigma = MappingProxyType(
        {
            1: 1.0 / (math.sqrt(math.pi) * math.erf(3.0) - 6.0 * LEFT),
            2: 1.0 / (math.pi * (1.0 - 10.0 * LEFT)),
            3: 1.0 / (math.pi**1.5 * math.erf(3.0) - 42.0 * math.pi * LEFT),
        }
    )
