"""Mie potentials, and Lennard-Jones's among them."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from ... import validate
from ...scene.law import Law, law
from ..pair import Pair
from .mixing import by_kinds


@law
def _first_power(s: float):
    return s


@functools.cache
def _power(n: int) -> Law:
    """s^n for a whole n, by squares and without a loop, which could not be derived."""
    if n == 1:
        return _first_power
    half = _power(n // 2)

    @law
    def even_power(s: float):
        root = half(s)
        return root * root

    @law
    def odd_power(s: float):
        root = half(s)
        return root * root * s

    return odd_power if n % 2 else even_power


@functools.cache
def _laws(n: int, m: int) -> tuple[Law, Law]:
    """Potential and force of the Mie family for whole exponents."""
    power_n, power_m = _power(n), _power(m)

    @law
    def mie_potential(r: float, strength: float, sigma: float):
        return strength * (power_n(sigma / r) - power_m(sigma / r))

    @law
    def mie_force(r: float, strength: float, sigma: float):
        inverse = 1.0 / r
        repulsion = power_n(sigma * inverse)
        attraction = power_m(sigma * inverse)
        return strength * (float(n) * repulsion - float(m) * attraction) * inverse

    return mie_potential, mie_force


@functools.cache
def _even_laws(n: int, m: int) -> tuple[Law, Law]:
    """By the square of the distance, for even exponents: u and F / r."""
    power_n, power_m = _power(n // 2), _power(m // 2)

    @law
    def mie_squared(distance_squared: float, strength: float, sigma: float):
        s = sigma * sigma / distance_squared
        return strength * (power_n(s) - power_m(s))

    @law
    def mie_force_over_r(distance_squared: float, strength: float, sigma: float):
        inverse = 1.0 / distance_squared
        s = sigma * sigma * inverse
        return strength * (float(n) * power_n(s) - float(m) * power_m(s)) * inverse

    @law
    def twice_force_over_r(distance_squared: float, strength: float, sigma: float):
        inverse = 1.0 / distance_squared
        power = power_m(sigma * sigma * inverse)
        # What is the same for all pairs stands together.
        return (float(n) * strength * power - float(m) * strength) * power * inverse

    return mie_squared, twice_force_over_r if n == 2 * m else mie_force_over_r


class Mie(Pair):
    r"""u = C epsilon ((sigma/r)^n - (sigma/r)^m), C = n/(n-m) (n/m)^(m/(n-m)) (Mie 1903).

    Args:
        group: Which particles interact with each other; None: all. A list of groups, one a kind,
            where epsilon, sigma or the cutoff go by kinds.
        epsilon: Depth of the well [energy], at least 0: a number, one a kind, or (kinds, kinds).
        sigma: Distance at which u = 0 [length], likewise.
        exponents: Whole (n, m), n > m > 0.
        cutoff: Distance beyond which there is no force [length], a number or (kinds, kinds); None:
            2.5 sigma.
        truncation: ``"cut"`` leaves u as it is; ``"shift"`` subtracts u(cutoff); ``"force_shift"``
            adds the line that makes the force continuous as well (Toxvaerd and Dyre 2011);
            ``"xplor"`` smooths it from ``switch`` of the cutoff on (Brooks et al. 1983).
        mixing: How kinds are mixed, of which each has its own: ``"lorentz_berthelot"`` (mean sigma,
            root of the product of the epsilons) or ``"geometric"`` (both roots).
        **options: ``groups``, ``exclude`` and ``switch``, as of ``Pair``.

    Example:
        >>> Mie(exponents=(14, 7), epsilon=2.0).parameters
        {'strength': 8.0, 'sigma': 1.0}
    """

    def __init__(
        self,
        group: Any = None,
        epsilon: Any = 1.0,
        sigma: Any = 1.0,
        exponents: tuple[int, int] = (12, 6),
        cutoff: Any = None,
        truncation: str = "cut",
        mixing: str = "lorentz_berthelot",
        **options: Any,
    ):
        if np.shape(exponents) != (2,):
            raise validate.fail(self.name, "exponents", "be two", exponents, "give (n, m), n > m")
        n, m = (validate.whole(self.name, "exponents", e, minimum=1) for e in exponents)
        if n <= m:
            raise validate.fail(self.name, "exponents", "fall", exponents, "give (n, m), n > m")
        self.epsilon, self.sigma = by_kinds(self.name, mixing, epsilon, sigma)
        self.exponents = (n, m)
        strength = n / (n - m) * (n / m) ** (m / (n - m)) * self.epsilon
        laws = (_laws if n % 2 or m % 2 else _even_laws)(n, m)
        cut = 2.5 * self.sigma if cutoff is None else cutoff
        values = {"strength": strength, "sigma": self.sigma}
        super().__init__(*laws, group, cut, values, truncation=truncation, **options)

    @property
    def acts(self) -> bool:
        return bool(np.any(self.epsilon))

    def tail(self, density: float) -> tuple[float, float]:
        """Energy and virial that the truncation leaves out of each particle, for g(r) = 1.

        From the cutoff to infinity U/N = 2 pi rho int u r^2 dr and W/N = -2 pi rho int u' r^3 dr
        (Allen and Tildesley 1987, eq. 2.144); n > m > 3. Within it, what a shift has taken from
        every pair, int u(r_c) r^2 dr, and of the force too where that is shifted. Of one kind, and
        not smoothed.

        Args:
            density: Particles a volume [1/length^3].
        """
        (n, m), s, cut = self.exponents, self.sigma, self.cutoff
        if m <= 3:
            raise validate.fail(self.name, "exponents", "be above 3", (n, m), "it has no tail")
        if self.chosen.kinds or self.truncation == "xplor" or cut is None:
            raise validate.fail(
                self.name, "tail", "be of one kind, and not smoothed", self.truncation,
                "integrate by its own g(r)",
            )  # fmt: skip
        strength = self.parameters["strength"]
        shifted = self.truncation in ("shift", "force_shift")
        u_cut = strength * ((s / cut) ** n - (s / cut) ** m) if shifted else 0.0
        f_cut = strength * (n * (s / cut) ** n - m * (s / cut) ** m) / cut
        f_cut = f_cut if self.truncation == "force_shift" else 0.0
        scale = 2.0 * np.pi * density * strength
        a = s**n * cut ** (3 - n) / (n - 3)
        b = s**m * cut ** (3 - m) / (m - 3)
        within = 2.0 * np.pi * density * cut**3
        energy = within * (u_cut / 3.0 + f_cut * cut / 12.0)
        virial = within * f_cut * cut / 4.0
        return float(scale * (a - b) + energy), float(scale * (n * a - m * b) + virial)


class LennardJones(Mie):
    r"""u = 4 epsilon ((sigma/r)^12 - (sigma/r)^6) (Lennard-Jones 1931): :class:`Mie` of (12, 6).

    Args:
        group, epsilon, sigma, cutoff, truncation, mixing, **options: As of :class:`Mie`.

    Example:
        >>> fluid = LennardJones(epsilon=1.0, sigma=1.0, cutoff=2.5)
        >>> round(fluid.parameters["strength"], 9)
        4.0
        >>> alloy = LennardJones(["a", "b"], epsilon=[1.0, 0.25], sigma=[1.0, 0.8])
        >>> alloy.epsilon.tolist(), alloy.sigma.tolist()
        ([[1.0, 0.5], [0.5, 0.25]], [[1.0, 0.9], [0.9, 0.8]])
    """

    def __init__(
        self,
        group: Any = None,
        epsilon: Any = 1.0,
        sigma: Any = 1.0,
        cutoff: Any = None,
        truncation: str = "cut",
        mixing: str = "lorentz_berthelot",
        **options: Any,
    ):
        super().__init__(group, epsilon, sigma, (12, 6), cutoff, truncation, mixing, **options)
