"""Tables: functions of one number that are given by points, for laws to call."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import warp as wp

from .. import validate
from ..kernels.precision import Precision
from ..kernels.table import table_function
from ..kernels.warp_internals import digest
from .law import Key, Law

MOST = 4096  # points


class Table(Law):
    """A function of one number by cubic splines through points, which laws call like any other.

    Between the points it is the cubic spline that is twice continuous, with the same cubic on both
    sides of the second point and of the last but one ("not a knot": de Boor 1978), of fourth order
    in the spacing; beyond the ends it goes on straight. What derives a law that calls it derives
    the spline: forces are minus the slope of energies to rounding.

    Args:
        x: Points at equal distances, rising, (n,), 4 to 4096 of them.
        y: Values there, (n,).

    Raises:
        ValueError: Points that are not at equal distances, too few or too many.

    Example:
        >>> import numpy as np
        >>> from particlesim import PairPotential, law
        >>> r = np.linspace(0.8, 2.5, 500)
        >>> shape = Table(r, 4 * (r**-12 - r**-6))
        >>> @law
        ... def tabulated(r: float, strength: float):
        ...     return strength * shape(r)
        >>> force = PairPotential(tabulated, cutoff=2.5, strength=1.0)
        >>> round(shape(1.5), 6)
        -0.320337
    """

    def __init__(self, x: Any, y: Any):
        x = validate.rows("Table", "x", x, np.size(x), None)
        if not 4 <= len(x) <= MOST:
            raise validate.fail(
                "Table", "x", f"hold 4 to {MOST} points", len(x), "choose another spacing"
            )
        y = validate.rows("Table", "y", y, len(x), None)
        self.spacing = float(x[-1] - x[0]) / (len(x) - 1)
        even = np.abs(np.diff(x) - self.spacing) <= 1e-6 * abs(self.spacing)
        if not (self.spacing > 0 and even.all()):
            raise validate.fail(
                "Table", "x", "rise by equal distances", np.diff(x)[:3].tolist(),
                "interpolate to such points first",
            )  # fmt: skip
        self.first, self.cubics = float(x[0]), _spline(y)
        self.parameters, self.defaults, self.returns = {"x": float}, {}, float
        self.func = self._value
        self._made: dict[str, wp.Function] = {}

    def _value(self, x: Any) -> Any:
        s = (np.asarray(x, dtype=np.float64) - self.first) / self.spacing
        n = len(self.cubics)
        inside = np.clip(s, 0.0, n)
        k = np.minimum(inside.astype(int), n - 1)
        t, (a, b, c, d) = inside - k, self.cubics[k].T
        value = a + t * (b + t * (c + t * d)) + (s - inside) * (b + t * (2 * c + t * 3 * d))
        return float(value) if np.ndim(x) == 0 else value

    @property
    def name(self) -> str:
        return "Table"

    @functools.cached_property
    def content(self) -> str:
        """Hash of the points."""
        return digest("table", self.first, self.spacing, self.cubics.tobytes().hex())

    @property
    def key(self) -> Key:
        return Key(self.content, "Table(x)", (), __name__)

    def check_derivable(self, owner: str) -> None:
        """It is."""

    def function(
        self, precision: Precision, owner: str = "law", returns: Any = None
    ) -> wp.Function:
        """The Warp function in ``precision``."""
        if precision.name not in self._made:
            self._made[precision.name] = table_function(
                precision, self.first, self.spacing, self.cubics
            )
        return self._made[precision.name]


def _spline(y: np.ndarray) -> np.ndarray:
    """Cubics a + b t + c t^2 + d t^3 from each point to the next, t from 0 to 1, (n - 1, 4).

    Its second derivatives m, by the spacing, fulfil m_(k-1) + 4 m_k + m_(k+1) = 6 times the second
    differences; with m_0 = 2 m_1 - m_2, and so at the other end, the first and last of these are
    6 m_1 and 6 m_(n-2) alone.
    """
    n = len(y)
    second = 6.0 * np.diff(y, 2)
    m = np.zeros(n)
    inner = np.full(n - 2, 4.0)
    beside = np.ones(n - 3)
    # Thomas's elimination; the rows at the ends hold one number.
    diagonal, right = inner.copy(), second.copy()
    diagonal[0] = diagonal[-1] = 6.0
    upper, lower = beside.copy(), beside.copy()
    upper[0] = lower[-1] = 0.0
    for k in range(1, n - 2):
        factor = lower[k - 1] / diagonal[k - 1]
        diagonal[k] -= factor * upper[k - 1]
        right[k] -= factor * right[k - 1]
    m[n - 2] = right[-1] / diagonal[-1]
    for k in range(n - 4, -1, -1):
        m[k + 1] = (right[k] - upper[k] * m[k + 2]) / diagonal[k]
    m[0], m[-1] = 2 * m[1] - m[2], 2 * m[-2] - m[-3]
    slope = np.diff(y) - (2 * m[:-1] + m[1:]) / 6
    return np.stack([y[:-1], slope, 0.5 * m[:-1], np.diff(m) / 6], axis=1)
