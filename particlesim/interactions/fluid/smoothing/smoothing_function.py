"""What a smoothing function is: laws of q = r / h, a support and a normalisation."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
import warp as wp

from .... import validate
from ....scene.law import Law, law
from ...laws.arguments import Arguments
from ...laws.trial import values

PANELS, NODES = 240, 8  # of Gauss's rule over a support: knots at halves and thirds are edges
ENDED = 1e-3  # of w(0), at most left at the end of the support
AGREES = 1e-3  # of the largest slope, how far a given one may be from the derivative
CENTER = 1e-6  # in h: slopes are not asked for nearer to the centre


@dataclass(frozen=True)
class Smoothing:
    """A smoothing function W(r, h) = sigma / h^d w(r / h) in d dimensions.

    ``weight`` is w(q), ``slope`` is w'(q) / q, which unlike w' needs no division by r for
    grad W = sigma / h^(d + 2) slope(q) x_ij, and ``curvature`` is w''(q). All are laws of q, zero
    from ``support`` on and free of branches, so that loops over them vectorise. ``center`` is w(0).
    """

    weight: Law
    slope: Law
    curvature: Law
    sigma: float
    support: float
    center: float

    @property
    def kind(self) -> tuple[Any, ...]:
        """What makes it the function that it is."""
        return (self.weight.key, self.slope.key, self.sigma, self.support)

    def at(self, q: np.ndarray) -> np.ndarray:
        """w at these q."""
        return _at("Smoothing", self.weight, q)


class SmoothingFunction:
    r"""Base of smoothing functions W(r, h) = sigma / h^d w(q), q = r / h; also one's own.

    A member gives ``weight``, the law w(q) in any units, and ``support``, the q from which on it is
    zero, 2 if not said. What else there is follows, if it is not given:

    - ``slope``: the law w'(q) / q, finite at q = 0; derived by ``wp.grad``;
    - ``curvature``: the law w''(q); derived of a slope that is given, else by differences, to 1e-5;
    - ``sigma``, a dict by dimension: by quadrature, so that W integrates to 1.

    Laws that choose by ``wp.max``, ``wp.min`` and ``wp.where`` rather than by ``if`` run on the
    CPU's vector units. ``in_dimension(d)`` gives the laws and numbers of one dimension, for sums
    of one's own.

    h is that of Monaghan (1992), so that functions may be exchanged at the same h: compact ones end
    at 2 h, the quintic spline and the Gaussian at 3 h. Who writes h for the radius of the support,
    as Mueller and Wendland do, means 2 h.

    Raises:
        ValueError: A weight that is not finite within the support or does not end with it, whose
            integral is not positive, or whose slope is not its derivative; a dimension that is not
            there.

    Example:
        >>> @law
        ... def bell(q: float):
        ...     s = wp.max(1.0 - 0.5 * q, 0.0)
        ...     return s * s * s * s * (1.0 + 2.0 * q)
        >>> class Bell(SmoothingFunction):
        ...     weight = bell
        >>> water = SPH(smoothing_length=0.1, rest_density=1.0, equation_of_state=Tait(30.0),
        ...             smoothing=Bell())
        >>> Bell().value([0.0, 0.1, 0.2], h=0.1, dimension=2).round(3).tolist()
        [55.704, 10.445, 0.0]
    """

    weight: Law
    slope: Law | None = None
    curvature: Law | None = None
    support: float = 2.0
    sigma: Mapping[int, float] = MappingProxyType({})
    center: float = 1.0  # w(0), where sigma is given
    dimensions: tuple[int, ...] = (1, 2, 3)

    @property
    def name(self) -> str:
        """What reports and errors call it."""
        return type(self).__name__

    def laws(self, dimension: int) -> tuple[Law, Law | None, Law | None]:
        """Weight, slope and curvature, for members who differ by dimension."""
        if not hasattr(self, "weight"):
            raise TypeError(f"{self.name}: laws must have a weight, got none; give it one.")
        return self.weight, self.slope, self.curvature

    def in_dimension(self, dimension: int) -> Smoothing:
        """The laws and the normalisation in 1, 2 or 3 dimensions."""
        if dimension not in self.dimensions:
            raise validate.fail(
                self.name, "dimension", f"be one of {self.dimensions}", dimension,
                "choose one of these",
            )  # fmt: skip
        weight, slope, curvature = (each and law(each) for each in self.laws(dimension))
        assert weight is not None
        if curvature is None:
            curvature = _curvature_of_slope(slope) if slope else _curvature_of_weight(weight)
        whole = weight, slope or _slope(weight), curvature
        if dimension in self.sigma:
            return Smoothing(*whole, self.sigma[dimension], self.support, self.center)
        sigma, center = self._measured(whole[0], whole[1], dimension)
        return Smoothing(*whole, sigma, self.support, center)

    def value(self, r: Any, h: float = 1.0, dimension: int = 3) -> np.ndarray:
        """W at these distances [1/length^d]."""
        own, q = self.in_dimension(dimension), self._distances(r, h)
        return own.sigma / h**dimension * _at(self.name, own.weight, q)

    def derivative(self, r: Any, h: float = 1.0, dimension: int = 3) -> np.ndarray:
        """dW/dr at these distances [1/length^(d+1)]; 0 at r = 0, its mean over directions."""
        own, q = self.in_dimension(dimension), self._distances(r, h)
        return own.sigma / h ** (dimension + 1) * q * _at(self.name, own.slope, q)

    def laplacian(self, r: Any, h: float = 1.0, dimension: int = 3) -> np.ndarray:
        """W'' + (d - 1) W' / r at these distances [1/length^(d+2)]."""
        own, q = self.in_dimension(dimension), self._distances(r, h)
        slope, curvature = _at(self.name, own.slope, q), _at(self.name, own.curvature, q)
        return own.sigma / h ** (dimension + 2) * (curvature + (dimension - 1) * slope)

    def _distances(self, r: Any, h: float) -> np.ndarray:
        validate.number(self.name, "h", h, above=0.0, unit="length")
        return np.asarray(r, dtype=np.float64) / h

    def _measured(self, weight: Law, slope: Law, dimension: int) -> tuple[float, float]:
        """sigma and w(0) of a weight whose normalisation is not known."""
        support = validate.number(self.name, "support", self.support, above=0.0)
        nodes, shares = np.polynomial.legendre.leggauss(NODES)
        edges = np.linspace(0.0, support, PANELS + 1)
        q = (edges[:-1, None] + 0.5 * support / PANELS * (nodes + 1.0)).ravel()
        w = _at(self.name, weight, np.append(q, [0.0, support]))
        center, end = w[-2:]
        if not np.isfinite(w).all():
            raise validate.fail(
                self.name, "weight", "be finite from 0 to the support", w[~np.isfinite(w)],
                "choose another law",
            )  # fmt: skip
        if not abs(end) <= ENDED * abs(center):
            raise validate.fail(
                self.name, "weight", f"end at the support, q = {support:g}", float(end),
                "subtract what is left there, or give the class another support",
            )  # fmt: skip
        change = np.gradient(w[:-2], q)
        error = np.abs(q * _at(self.name, slope, q) - change)[1:-1]
        if not np.median(error) <= AGREES * np.abs(change).max():
            raise validate.fail(
                self.name, "slope", "be w'(q) / q", float(np.median(error)), "leave it out"
            )
        shell = {1: 2.0, 2: 2.0 * np.pi * q, 3: 4.0 * np.pi * q**2}[dimension]
        whole = float((w[:-2] * shell * np.tile(shares, PANELS)).sum() * 0.5 * support / PANELS)
        if not whole > 0.0:
            raise validate.fail(
                self.name, "weight", "have a positive integral", whole, "choose another law"
            )
        return 1.0 / whole, float(center)


def _at(owner: str, each: Law, q: np.ndarray) -> np.ndarray:
    """A law at these q, in float64."""
    found = values(Arguments(owner, each, 1, {}, ()), {"q": q.ravel()}, q.size)
    return found.reshape(q.shape)


@functools.cache
def _slope(weight: Law) -> Law:
    """w' / q of a weight."""

    @law
    def derived_slope(q: float):
        r = wp.max(q, CENTER)
        return wp.grad(weight)(r) / r

    return derived_slope


@functools.cache
def _curvature_of_slope(slope: Law) -> Law:
    """w'' = s + q s' of s = w' / q."""

    @law
    def derived_curvature(q: float):
        return slope(q) + q * wp.grad(slope)(q)

    return derived_curvature


@functools.cache
def _curvature_of_weight(weight: Law) -> Law:
    """w'' by central differences of w', whose step balances their error and float32's rounding."""

    @law
    def difference_curvature(q: float):
        r = wp.max(q, 1.0e-3)
        return (wp.grad(weight)(r + 1.0e-3) - wp.grad(weight)(r - 1.0e-3)) / 2.0e-3

    return difference_curvature
