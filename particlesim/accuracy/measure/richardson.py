"""Richardson's extrapolation: a limit, the order of its approach, and how sure that is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

LEAST, MOST = 0.5, 6.0  # orders that are believed
EXPECTED = 0.15  # by which an order may miss the nominal one, to be believed at once, and
ALIKE = 0.3  # by which those of successive refinements may differ; both where steps are halved
NEAR = 0.3  # by which it may miss a whole number, to be taken for that
DOUBT = 0.1  # of the last correction: an extrapolation is never believed to be better than that
CAREFUL = 3.0  # times a change that follows no order: the factor of safety of two grids (Roache)
ROUNDING = 1e-13  # of the values, float64: changes below it are none


@dataclass(frozen=True)
class Limit:
    """What refined values tend to.

    Args:
        value: The limit.
        unsure: How far off it may be; infinite while there are too few values.
        order: At which it is approached; None where no order is to be seen, infinite of values
            that do not change.
        off: By how much the finest value lies above it.
        step: Of the finest value.
    """

    value: float
    unsure: float
    order: float | None
    off: float
    step: float

    @property
    def bias(self) -> float:
        """Distance of the finest value from the limit."""
        return abs(self.off)

    def step_for(self, bias: float) -> float:
        """The step whose value is off by ``bias``; where no order says so, the finest."""
        if self.order is None:
            return self.step
        if self.order == math.inf or not self.bias:
            return math.inf
        return self.step * (bias / self.bias) ** (1.0 / self.order)

    def off_at(self, step: float) -> float:
        """By how much the value at a step lies above the limit."""
        if self.order is None or self.order == math.inf:
            return self.off
        return self.off * (step / self.step) ** self.order

    def __str__(self) -> str:
        if self.order is None:
            return "no order"
        return "no change" if self.order == math.inf else f"order {self.order:.3g}, extrapolated"


def limit(
    steps: Sequence[float], values: Sequence[float] | np.ndarray, nominal: float | None = None
) -> Limit:
    """The limit of values at falling steps, by the last three of them.

    The order p solves (y0 - y1) / (y1 - y2) = (h0^p - h1^p) / (h1^p - h2^p). It is believed if it
    is the nominal one, or that of the values before, twice. Then the limit is
    y2 + (y2 - y1) / (r^q - 1) (Richardson 1911), r = h1 / h2 and q the whole number that p is near
    to, and unsure by what it has changed by, and by what p in the place of q would make of it. The
    former is r^s - 1 times what it is off by, s the order of the next term. Else the limit is the
    finest value, unsure by three times the last change (Roache 1994, of two grids).

    Args:
        steps: (m,) falling.
        values: (m,).
        nominal: The order to be expected, if there is one.
    """
    h, y = np.asarray(steps, float), np.asarray(values, float)
    step, last = float(h[-1]), float(y[-1])
    if len(y) < 3:
        return Limit(last, math.inf, None, math.inf, step)
    changes = np.diff(y)
    nothing = ROUNDING * float(np.abs(y).max())
    if np.abs(changes[-2:]).max() <= nothing:
        return Limit(last, nothing, math.inf, nothing, step)
    p = _believed(h, changes, nominal)
    if p is None:
        change = float(max(abs(changes[-1]), 0.5 * abs(changes[-2])))
        return Limit(last, CAREFUL * change, None, change, step)

    def beyond(order: float, k: int) -> float:
        return float(changes[k] / ((h[k - 1] / h[k]) ** order - 1.0))

    near = abs(p - round(p)) < NEAR
    order = float(round(p)) if near else p
    other = p if near else max(math.floor(p), LEAST)
    now, before = last + beyond(order, -1), float(y[-2]) + beyond(order, -2)
    bias = abs(last - now)
    shifts = (abs(now - before), abs(beyond(order, -1) - beyond(other, -1)))
    return Limit(now, max(*shifts, DOUBT * bias, nothing), order, last - now, step)


def found_order(steps: np.ndarray, changes: np.ndarray) -> float | None:
    """The order of the last two changes; None where they do not fall, to one side."""
    first, second = changes[-2:]
    if first * second <= 0:
        return None
    h0, h1, h2 = steps[-3:]
    ratio = first / second

    def too_low(p: float) -> bool:
        return ((h0 / h1) ** p - 1.0) / (1.0 - (h2 / h1) ** p) < ratio

    low, high = 1e-3, 2.0 * MOST
    if not too_low(low) or too_low(high):
        return None
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if too_low(middle) else (low, middle)
    return 0.5 * (low + high)


def _believed(h: np.ndarray, changes: np.ndarray, nominal: float | None) -> float | None:
    """The order of the last three values, if there is reason to take it for one."""
    p = found_order(h, changes)
    if p is None or not LEAST <= p <= MOST:
        return None
    closer = math.log2(h[-2] / h[-1])  # the less there is between steps, the less they tell
    if nominal is not None and abs(p - nominal) < EXPECTED * closer:
        return p
    for back in (1, 2):
        before = found_order(h[:-back], changes[:-back]) if len(changes) > 1 + back else None
        if before is None or abs(p - before) > ALIKE * back * closer:
            return None
    return p
