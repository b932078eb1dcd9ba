"""Lennard-Jones and, by its exponents, Mie potentials."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from .. import validate
from ..scene.law import Law, law
from .pair import Pair

TRUNCATIONS = ("cut", "shift", "force_shift")


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
    def mie_potential(
        r: float, strength: float, sigma: float, u_cut: float, f_cut: float, cut: float
    ):
        repulsion = power_n(sigma / r)
        attraction = power_m(sigma / r)
        return strength * (repulsion - attraction) - u_cut + (r - cut) * f_cut

    @law
    def mie_force(r: float, strength: float, sigma: float, u_cut: float, f_cut: float, cut: float):
        inverse = 1.0 / r
        repulsion = power_n(sigma * inverse)
        attraction = power_m(sigma * inverse)
        return strength * (float(n) * repulsion - float(m) * attraction) * inverse - f_cut

    return mie_potential, mie_force


@functools.cache
def _even_laws(n: int, m: int) -> tuple[Law, Law]:
    """By the square of the distance, for even exponents and an unshifted force: u and F / r."""
    power_n, power_m = _power(n // 2), _power(m // 2)

    @law
    def mie_squared(
        distance_squared: float, strength: float, sigma: float, u_cut: float, f_cut: float,
        cut: float,
    ):  # fmt: skip
        s = sigma * sigma / distance_squared
        return strength * (power_n(s) - power_m(s)) - u_cut

    @law
    def mie_force_over_r(
        distance_squared: float, strength: float, sigma: float, u_cut: float, f_cut: float,
        cut: float,
    ):  # fmt: skip
        inverse = 1.0 / distance_squared
        s = sigma * sigma * inverse
        return strength * (float(n) * power_n(s) - float(m) * power_m(s)) * inverse

    @law
    def twice_force_over_r(
        distance_squared: float, strength: float, sigma: float, u_cut: float, f_cut: float,
        cut: float,
    ):  # fmt: skip
        inverse = 1.0 / distance_squared
        power = power_m(sigma * sigma * inverse)
        # What is the same for all pairs stands together.
        return (float(n) * strength * power - float(m) * strength) * power * inverse

    return mie_squared, twice_force_over_r if n == 2 * m else mie_force_over_r


class LennardJones(Pair):
    r"""Mie potential u = C epsilon ((sigma/r)^n - (sigma/r)^m), C = n/(n-m) (n/m)^(m/(n-m)).

    With the exponents (12, 6) it is the Lennard-Jones potential 4 epsilon ((sigma/r)^12 -
    (sigma/r)^6) (Lennard-Jones 1931; Mie 1903).

    Args:
        group: Which particles interact with each other; None: all.
        epsilon: Depth of the well [energy], at least 0.
        sigma: Distance at which u = 0 [length].
        cutoff: Distance beyond which there is no force [length]; None: 2.5 sigma.
        exponents: Whole (n, m), n > m > 0.
        truncation: ``"cut"`` leaves u as it is; ``"shift"`` subtracts u(cutoff); ``"force_shift"``
            adds the line that makes the force continuous as well (Toxvaerd and Dyre 2011).

    Example:
        >>> fluid = LennardJones(epsilon=1.0, sigma=1.0, cutoff=2.5)
        >>> round(fluid.parameters["strength"], 9)
        4.0
    """

    def __init__(
        self,
        group: Any = None,
        epsilon: float = 1.0,
        sigma: float = 1.0,
        cutoff: float | None = None,
        exponents: tuple[int, int] = (12, 6),
        truncation: str = "cut",
    ):
        epsilon = validate.number(self.name, "epsilon", epsilon, minimum=0.0, unit="energy")
        sigma = validate.number(self.name, "sigma", sigma, above=0.0, unit="length")
        if np.shape(exponents) != (2,):
            raise validate.fail(self.name, "exponents", "be two", exponents, "give (n, m), n > m")
        n, m = (validate.whole(self.name, "exponents", e, minimum=1) for e in exponents)
        if n <= m:
            raise validate.fail(self.name, "exponents", "fall", exponents, "give (n, m), n > m")
        validate.choice(self.name, "truncation", truncation, TRUNCATIONS)
        cut = 2.5 * sigma if cutoff is None else cutoff
        cut = validate.number(self.name, "cutoff", cut, above=0.0, unit="length")
        self.exponents, self.epsilon, self.sigma = (n, m), epsilon, sigma
        strength = n / (n - m) * (n / m) ** (m / (n - m)) * epsilon
        s = sigma / cut
        u_cut = strength * (s**n - s**m) if truncation != "cut" else 0.0
        f_cut = strength * (n * s**n - m * s**m) / cut if truncation == "force_shift" else 0.0
        even = n % 2 == 0 and m % 2 == 0 and truncation != "force_shift"
        super().__init__(
            *(_even_laws(n, m) if even else _laws(n, m)), group, cut,
            {"strength": strength, "sigma": sigma, "u_cut": u_cut, "f_cut": f_cut, "cut": cut},
        )  # fmt: skip

    @property
    def acts(self) -> bool:
        return self.epsilon > 0

    def tail(self, density: float) -> tuple[float, float]:
        """Energy and virial that the truncation leaves out of each particle, for g(r) = 1.

        From the cutoff to infinity U/N = 2 pi rho int u r^2 dr and W/N = -2 pi rho int u' r^3 dr
        (Allen and Tildesley 1987, eq. 2.144); n > m > 3. Within it, what a shift has taken from
        every pair, int u(r_c) r^2 dr, and of the force too where that is shifted.

        Args:
            density: Particles a volume [1/length^3].
        """
        (n, m), s, cut = self.exponents, self.sigma, self.parameters["cut"]
        if m <= 3:
            raise validate.fail(self.name, "exponents", "be above 3", (n, m), "it has no tail")
        scale = 2.0 * np.pi * density * self.parameters["strength"]
        a = s**n * cut ** (3 - n) / (n - 3)
        b = s**m * cut ** (3 - m) / (m - 3)
        u_cut, f_cut = self.parameters["u_cut"], self.parameters["f_cut"]
        within = 2.0 * np.pi * density * cut**3
        energy = within * (u_cut / 3.0 + f_cut * cut / 12.0)
        virial = within * f_cut * cut / 4.0
        return float(scale * (a - b) + energy), float(scale * (n * a - m * b) + virial)
