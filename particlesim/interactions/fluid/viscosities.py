"""Viscosities of SPH: what is added to the pressure of a pair because it moves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...scene.law import Law, law
from .equations_of_state import FluidPart


class Viscosity(FluidPart):
    """Base of viscosities, which act on pairs because they move; also one's own.

    A member sets ``parameters``, a dict of numbers that may differ from world to world, and gives
    one law or both:

    - ``term``: Pi_ij beside P/rho^2 [length^5 / (mass time^2)] for a force along the pair, which
      conserves angular momentum too. To take energy out, it must have the sign of -``approach``.
    - ``drag``: D_ij [length^5 / (mass time)] for a force along the difference of the velocities,
      f_ij = m_i m_j D_ij W'_ij / r v_ij, which takes energy out where D_ij > 0 and conserves the
      momentum alone.

    Both must be the same for i and j, and may name

    - ``distance_squared``: r^2 [length^2];
    - ``smoothing_length``, ``rest_density``: of the ``SPH``;
    - ``sound_speed``: the mean of the pair;
    - a ``term``: ``density``, the mean of the pair, and ``approach``: v_ij . x_ij, negative where
      the pair approaches [length^2/time];
    - a ``drag``: ``density_i`` and ``density_j``;
    - the member's own ``parameters``.

    They must not branch (``wp.where``, ``wp.min``), so that the loop over neighbours vectorises.

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
    drag: Law
    switched = False  # the term is weakened by Balsara's switch
    drifts = ""  # how it has particles move otherwise than with their velocity

    @property
    def law_names(self) -> tuple[str, ...]:  # type: ignore[override]
        """Those of the laws that it gives; of none, the one that is missing."""
        given = tuple(name for name in ("term", "drag") if hasattr(self, name))
        return given if given or self.drifts else ("term",)


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
    energy into heat that nobody keeps. In shear it is a kinematic viscosity of nearly
    alpha c h / (4 (d + 2)) in d dimensions: half of what it would be if receding pairs felt it too,
    alpha c h / 10 in three dimensions (Lodato and Price 2010). That is an integral; the sums of
    Wendland's C2 make 0.95 to 0.97 of it at h = 2 spacings, 0.90 to 0.98 at 1.6, and at 1.3 0.84 to
    0.88 as long as a lattice lasts in shear, which is not long; its ruins have no one viscosity.

    Args:
        alpha: Strength of the part linear in the speed, at least 0.
        beta: Strength of the quadratic part, which keeps fast streams from passing through
            each other, at least 0; 2 alpha is usual for shocks.
        balsara: Weaken the term by the mean over the pair of f = |div v| / (|div v| + |curl v| +
            0.0001 c / h), which is 1 in a shock and 0 in pure shear (Balsara 1995): for discs and
            whirls that are to keep turning. Takes one more pass over the pairs.

    Example:
        >>> ArtificialViscosity(0.05).parameters
        {'alpha': 0.05, 'beta': 0.0}
    """

    term = artificial_viscosity

    def __init__(self, alpha: float, beta: float = 0.0, *, balsara: bool = False) -> None:
        self.parameters = {
            "alpha": validate.number(self.name, "alpha", alpha, minimum=0.0),
            "beta": validate.number(self.name, "beta", beta, minimum=0.0),
        }
        self.switched = bool(balsara)


@law
def laminar_drag(density_i: float, density_j: float, kinematic_viscosity: float):
    return kinematic_viscosity * (density_i + density_j) / (density_i * density_j)


@law
def laminar_drag_between(
    density_i: float, density_j: float, kinematic_viscosity_i: float, kinematic_viscosity_j: float
):
    both = kinematic_viscosity_i * density_i + kinematic_viscosity_j * density_j
    return both / (density_i * density_j)


class LaminarViscosity(Viscosity):
    """The viscosity of a real fluid, nu lap v (Morris, Fox and Zhu 1997, eq. 22).

        f_ij = m_i m_j nu (rho_i + rho_j) / (rho_i rho_j) W'_ij / r v_ij

    The same for pairs that approach and that recede; without the 0.01 h^2 of the original in r^2,
    as W' / r is finite. It acts along the difference of the velocities and not along the pair: it
    conserves the momentum to round-off, the angular momentum only as well as the sums make a
    laplacian, and brakes any relative motion.

    In several fluids nu rho is that of either particle: the term is V_i V_j (eta_i + eta_j) W'_ij
    / r v_ij with dynamic viscosities eta = nu rho and volumes V = m / rho (Hu and Adams 2006).

    Args:
        kinematic_viscosity: nu [length^2/time], at least 0; or one a fluid.

    Example:
        >>> LaminarViscosity(1e-6).parameters
        {'kinematic_viscosity': 1e-06}
    """

    drag = laminar_drag

    def __init__(self, kinematic_viscosity: float | Sequence[float]) -> None:
        self.parameters = {
            "kinematic_viscosity": validate.table(
                self.name, "kinematic_viscosity", kinematic_viscosity, minimum=0.0,
                unit="length^2/time",
            )
        }  # fmt: skip
        if np.ndim(kinematic_viscosity):
            self.drag = laminar_drag_between


class XSPH(Viscosity):
    """Particles move with a velocity that is mixed with their neighbours' (Monaghan 1989, eq. 2.6).

        dx_i/dt = v_i + epsilon sum_j m_j (v_j - v_i) / rho_ij W_ij

    with rho_ij the mean of the pair. It keeps particles in order and those of two streams from
    passing through each other, and is no force: velocities and the momentum stay as they are, and
    nothing is heated. The velocities that are mixed are those at which the forces are taken, so
    that energy and angular momentum are conserved to the first order of the step.

    Args:
        epsilon: From 0, no mixing, to 1; 0.5 is usual.

    Example:
        >>> fluid = SPH(smoothing_length=0.1, rest_density=1.0, equation_of_state=Tait(30.0),
        ...             viscosity=[ArtificialViscosity(0.05), XSPH(0.5)])
    """

    drifts = "mixing"

    def __init__(self, epsilon: float = 0.5) -> None:
        self.parameters = {
            "epsilon": validate.number(self.name, "epsilon", epsilon, minimum=0.0, maximum=1.0)
        }


class ParticleShifting(Viscosity):
    """Particles also drift from where they are dense to where they are not.

        dx_i/dt = v_i - 8 U h sum_j m_j / rho_ij grad_i W_ij        (rho_ij the mean of the pair)

    (Lind, Xu, Stansby and Rogers 2012, whose factor depends on the step and is 20 or so; that of
    Sun, Colagrossi, Marrone and Zhang 2017 is 2.) No viscosity, but what spares a flow one: a
    lattice that is sheared breaks up, and its ruins brake the flow. Shifted, particles stay in
    order: a vortex at Re 100, 64 across, which had lost 41 % of its kinetic energy too much by the
    time that a fifth is left, then loses 2.5 %. Best with many neighbours, h = 2 spacings of
    Wendland's C2. For fluids that fill a periodic box: a free surface would spread, so that others
    are refused. Velocities, and so the momentum and the kinetic energy, stay as they are; the
    angular momentum does not.

    Args:
        speed: U, the largest of the flow [length/time], at least 0.

    Example:
        >>> water = SPH(smoothing_length=0.1, rest_density=1.0, equation_of_state=Tait(10.0),
        ...             viscosity=[LaminarViscosity(0.01), ParticleShifting(1.0)])
    """

    drifts = "shifting"

    def __init__(self, speed: float) -> None:
        self.parameters = {
            "speed": validate.number(self.name, "speed", speed, minimum=0.0, unit="length/time")
        }


def several(owner: str, given: Any) -> tuple[Viscosity, ...]:
    """A viscosity, several of them or None, as a tuple.

    Raises:
        TypeError: Something is none. ValueError: Two are of one kind.
    """
    found = tuple(given) if isinstance(given, list | tuple) else (given,) * (given is not None)
    kinds: set[str] = set()
    for each in found:
        if not isinstance(each, Viscosity):
            raise TypeError(
                f"{owner}: viscosity must be a Viscosity, got {each!r}; give "
                "ArtificialViscosity(0.05)."
            )
        own = {*each.laws, *each.parameters, *(["drift"] if each.drifts else [])}
        if kinds & own:
            raise validate.fail(
                owner, "viscosity", "be several of different kinds",
                [other.name for other in found], "leave one out",
            )  # fmt: skip
        kinds |= own
    return found
