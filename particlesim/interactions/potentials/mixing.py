"""Parameters by kinds, from those of each kind."""

from __future__ import annotations

from typing import Any

import numpy as np

from ... import validate

RULES = ("lorentz_berthelot", "geometric")


def by_kinds(
    owner: str, rule: str, epsilon: Any, sigma: Any
) -> tuple[float | np.ndarray, float | np.ndarray]:
    """An energy and a length, numbers or tables by kinds, (kinds, kinds).

    Args:
        owner: For errors.
        rule: Of what is given by kind, (kinds,): the length is the mean of the two, and the energy
            the root of their product (Lorentz 1881, Berthelot 1898); or both are roots.
        epsilon: Energy, at least 0: a number, (kinds,) or (kinds, kinds).
        sigma: Length, above 0, likewise.
    """
    validate.choice(owner, "mixing", rule, RULES)
    energy = validate.table(owner, "epsilon", epsilon, minimum=0.0, unit="energy")
    length = validate.table(owner, "sigma", sigma, above=0.0, unit="length")
    if np.ndim(energy) == 1:
        energy = _roots(energy)
    if np.ndim(length) == 1:
        mean = rule == "lorentz_berthelot"
        length = 0.5 * np.add.outer(length, length) if mean else _roots(length)
    return energy, length


def _roots(values: Any) -> np.ndarray:
    """Roots of the products of each two."""
    return np.sqrt(np.multiply.outer(values, values))
