"""Viscosities of SPH: what is added to the pressure of a pair because it moves."""

from __future__ import annotations

import warp as wp

from ... import validate
from ...scene.law import Law, law
from .equations_of_state import FluidPart


class Viscosity(FluidPart):
    """Base of viscosities that act along the pair, as a term Pi_ij beside P/rho^2; also one's own.

    A member sets ``parameters``, a dict of numbers that may differ from world to world, and gives
    one law, ``term``: Pi_ij [length^5 / (mass time^2)], the same for i and j, of what it names of

    - ``approach``: v_ij . x_ij, negative where the pair approaches [length^2/time];
    - ``distance_squared``: r^2 [length^2];
    - ``smoothing_length``, ``rest_density``: of the ``SPH``;
    - ``density`` and ``sound_speed``: means of the pair;
    - the member's own ``parameters``.

    It must not branch (``wp.where``, ``wp.min``), so that the loop over neighbours vectorises. To
    take energy out, it must have the sign of -``approach``.

    Example:
        >>> @law
        ... def linear(approach: float, distance_squared: float, density: float, nu: float):
        ...     return -10.0 * nu * approach / (density * distance_squared)
        >>> class Linear(Viscosity):
        ...     term = linear
        ...     def __init__(self, nu):
        ...         self.parameters = {"nu": nu}
        >>> sorted(SPH(smoothing_length=0.1, rest_density=1.0, equation_of_state=Tait(30.0),
        ...            viscosity=Linear(1e-6)).parameters)[-1]
        'viscosity_nu'
    """

    term: Law
    law_names = ("term",)


@law
def artificial_viscosity(
    approach: float, distance_squared: float, smoothing_length: float, density: float,
    sound_speed: float, alpha: float, beta: float,
):  # fmt: skip
    h = smoothing_length
    mu = h * wp.min(approach, 0.0) / (distance_squared + 0.01 * h * h)
    return (beta * mu - alpha * sound_speed) * mu / density


class ArtificialViscosity(Viscosity):
    """Pi_ij = (-alpha c mu + beta mu^2) / rho, mu = h v_ij.x_ij / (r^2 + 0.01 h^2).

    Where v_ij.x_ij < 0, with the means of c and rho over the pair; pairs that recede feel nothing
    (Monaghan 1992, eqs. 4.1 and 4.2). It conserves momentum and angular momentum and turns kinetic
    energy into heat that nobody keeps. In shear it is a kinematic viscosity of about
    alpha c h / (4 (d + 2)) in d dimensions (in two, measured within 5 %): half of what it would be
    if receding pairs felt it too, alpha c h / 10 in three dimensions (Lodato and Price 2010).

    Args:
        alpha: Strength of the part linear in the speed, at least 0.
        beta: Strength of the quadratic part, which keeps fast streams from passing through
            each other, at least 0; 2 alpha is usual for shocks.

    Example:
        >>> ArtificialViscosity(0.05).parameters
        {'alpha': 0.05, 'beta': 0.0}
    """

    term = artificial_viscosity

    def __init__(self, alpha: float, beta: float = 0.0) -> None:
        self.parameters = {
            "alpha": validate.number(self.name, "alpha", alpha, minimum=0.0),
            "beta": validate.number(self.name, "beta", beta, minimum=0.0),
        }
