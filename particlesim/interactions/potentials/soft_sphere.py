"""Soft spheres, which push each other where they overlap."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...scene.law import law
from ..pair import Pair
from .mixing import by_kinds


@law
def soft_sphere_potential(r: float, epsilon: float, sigma: float, exponent: float):
    overlap = wp.max(1.0 - r / sigma, 0.0)
    return epsilon / exponent * wp.pow(overlap, exponent)


@law
def soft_sphere_force(r: float, epsilon: float, sigma: float, exponent: float):
    overlap = wp.max(1.0 - r / sigma, 0.0)
    return epsilon / sigma * wp.pow(overlap, exponent - 1.0)


class SoftSphere(Pair):
    """u = (epsilon / a) (1 - r / sigma)^a where r < sigma (O'Hern et al. 2003).

    a = 2 are harmonic, a = 5/2 Hertzian spheres. Forces are bounded, at epsilon / sigma.

    Args:
        group: Which particles interact with each other; None: all. A list of groups, one a kind,
            where something goes by kinds.
        epsilon: Energy, at least 0: a number, one a kind, or (kinds, kinds).
        sigma: Distance at which they touch [length], above 0; likewise.
        exponent: a, at least 1.5, which is what forces need to be continuous by a root.
        mixing: How kinds are mixed, as of :class:`Mie`.
        **options: ``groups`` and ``exclude``, as of ``Pair``.

    Example:
        >>> SoftSphere(["small", "large"], sigma=[1.0, 1.4]).cutoff
        1.4
    """

    def __init__(
        self, group: Any = None, epsilon: Any = 1.0, sigma: Any = 1.0, exponent: float = 2.0,
        mixing: str = "lorentz_berthelot", **options: Any,
    ):  # fmt: skip
        self.epsilon, self.sigma = by_kinds(self.name, mixing, epsilon, sigma)
        exponent = validate.number(self.name, "exponent", exponent, minimum=1.5)
        values = {"epsilon": self.epsilon, "sigma": self.sigma, "exponent": exponent}
        super().__init__(
            soft_sphere_potential, soft_sphere_force, group, self.sigma, values, **options
        )

    @property
    def acts(self) -> bool:
        return bool(np.any(self.epsilon))
