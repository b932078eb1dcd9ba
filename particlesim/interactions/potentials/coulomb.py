"""Coulomb's law: between all pairs, or damped and shifted to end at a cutoff."""

from __future__ import annotations

from typing import Any

import warp as wp

from ... import validate
from ...scene.law import law
from ..pair import Pair


@law
def coulomb_potential(r: float, charge_i: float, charge_j: float, constant: float):
    return (constant * charge_i) * (charge_j / r)


@law
def coulomb_force(r: float, charge_i: float, charge_j: float, constant: float):
    return (constant * charge_i / r) * (charge_j / r)


@law
def damped_potential(
    r: float, charge_i: float, charge_j: float, constant: float, damping: float
):  # fmt: skip
    return (constant * charge_i) * charge_j * wp.erfc(damping * r) / r


class Coulomb(Pair):
    """u = k q_i q_j / r between the particles' attributes ``charge`` (Coulomb 1785).

    Without a cutoff all pairs of a world, which costs the square of their number. With one the
    force is shifted to end there continuously, and with a ``damping`` a falls off as
    erfc(a r) / r before (Fennell and Gezelter 2006, eq. 19): of a neutral liquid or crystal it
    gives forces within a per cent of Ewald's sum at a = 0.2 and a cutoff of 12, in angstroms. What
    a charge feels of the surface of its own sphere, a constant, is no part of the energy here.

    Args:
        group: Which particles interact with each other; None: all.
        constant: k [energy length / charge^2].
        cutoff: Distance beyond which there is no force [length]; None: all pairs.
        damping: a [1/length], at least 0; only with a cutoff.
        truncation: Of a law with a cutoff, as of ``Pair``.
        **options: ``switch``, ``groups`` and ``exclude``, as of ``Pair``.

    Example:
        >>> Coulomb(constant=1.0, cutoff=6.0, damping=0.3).truncation
        'force_shift'
    """

    def __init__(
        self, group: Any = None, constant: float = 1.0, cutoff: Any = None, damping: float = 0.0,
        truncation: str = "force_shift", **options: Any,
    ):  # fmt: skip
        values = {"constant": validate.number(self.name, "constant", constant)}
        damping = validate.number(self.name, "damping", damping, minimum=0.0, unit="1/length")
        if cutoff is None:
            if damping > 0:
                raise validate.fail(
                    self.name, "damping", "be 0 without a cutoff", damping, "give a cutoff"
                )
            truncation = "cut"
        if damping > 0:
            values["damping"] = damping
            super().__init__(
                damped_potential, None, group, cutoff, values, truncation=truncation, **options
            )
        else:
            super().__init__(
                coulomb_potential, coulomb_force, group, cutoff, values, truncation=truncation,
                **options,
            )  # fmt: skip
