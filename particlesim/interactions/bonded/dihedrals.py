"""Dihedrals: how far two planes through three bonded particles each are turned."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...kernels.interactions import coordinates
from .bonded import Bonded


class Dihedrals(Bonded):
    """Dihedrals by an energy law u(dihedral, ...), -pi to pi.

    By the convention of IUPAC it is 0 where the first and the last particle are on one side of the
    middle bond (cis), pi where they are opposite (trans), and positive if the far bond, seen along
    the middle one, is turned clockwise from the near one. Laws should repeat after 2 pi.

    Forces divide by the sine of no dihedral (Blondel and Karplus 1996, eq. 27). Where three
    particles are on a line there is no dihedral, and near it the gradient grows without bound:
    below a sine of 1e-3 of the angle of neighbouring bonds all forces of the tuple fade with its
    square, to nothing on the line. They stay within 1000 |du/ddihedral| over the bonds' lengths,
    opposite and without torque; within that thousandth of a radian they are not the slope of the
    energy.

    Args:
        quadruples: (m, 4) indices along the bonds.
        law: ``u(dihedral, ...)`` [energy], of the dihedral [rad].
        **parameters: The law's further parameters, one for all or (m,) each, whole where it takes
            an ``int``; those not given are quantities of the four particles in their order
            (``charge_i`` to ``charge_l``).

    Raises:
        ValueError: Wrong shapes, particles that are the same, a parameter that is missing.
        TypeError: A parameter that the law does not have.

    Example:
        >>> import warp as wp
        >>> from particlesim import law
        >>> @law
        ... def torsion(dihedral: float, barrier: float, multiplicity: int):
        ...     return 0.5 * barrier * (1.0 + wp.cos(float(multiplicity) * dihedral))
        >>> Dihedrals([(0, 1, 2, 3)], torsion, barrier=2.0, multiplicity=3).quadruples.shape
        (1, 4)
    """

    argument, size = "quadruples", 4
    coordinate = coordinates.dihedral

    quadruples: np.ndarray

    def __init__(self, quadruples: Any, law: Any, **parameters: Any) -> None:
        super().__init__(law, quadruples, parameters)
