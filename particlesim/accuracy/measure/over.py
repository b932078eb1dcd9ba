"""Over: one number out of what is observed at the start and after every frame."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ... import validate

OWNER = "measure"
Reduction = Callable[[np.ndarray, np.ndarray], float]  # of times (m,) and values (m,)


def final(times: np.ndarray, values: np.ndarray) -> float:
    """The last value."""
    return float(values[-1])


def mean(times: np.ndarray, values: np.ndarray) -> float:
    """The mean of all."""
    return float(values.mean())


def largest(times: np.ndarray, values: np.ndarray) -> float:
    """The largest of all."""
    return float(values.max())


def rms(times: np.ndarray, values: np.ndarray) -> float:
    """Root mean square of all."""
    return float(np.sqrt((values**2).mean()))


def period(times: np.ndarray, values: np.ndarray) -> float:
    """The time of one oscillation: between the first and the last upward crossing of the middle.

    The middle is that of the largest and the smallest value. A crossing is the root of the cubic
    through two frames on either side of it: exact to h^4 at h between frames.

    Raises:
        ValueError: It does not cross it twice.
    """
    x = values - 0.5 * (values.max() + values.min())
    rising = np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))
    rising = rising[(rising >= 1) & (rising + 2 < len(x))]
    if len(rising) < 2:
        raise validate.fail(
            OWNER, "frames", "hold two upward crossings of the middle, for a period", len(rising),
            "observe for longer, or what oscillates",
        )  # fmt: skip
    first, last = (times[k] + (times[k + 1] - times[k]) * _root(x[k - 1 : k + 3])
                   for k in (rising[0], rising[-1]))  # fmt: skip
    return float((last - first) / (len(rising) - 1))


def _root(x: np.ndarray) -> float:
    """Where in [0, 1] the cubic through values at -1, 0, 1 and 2 crosses zero, by bisection."""
    cubic = np.polyfit([-1.0, 0.0, 1.0, 2.0], x, 3)
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if np.polyval(cubic, middle) < 0 else (low, middle)
    return 0.5 * (low + high)


REDUCTIONS: dict[str, Reduction] = {
    "final": final, "mean": mean, "max": largest, "rms": rms, "period": period,
}  # fmt: skip


def reduction(over: Any) -> Reduction:
    """The function that is given, or named."""
    return over if callable(over) else REDUCTIONS[validate.choice(OWNER, "over", over, REDUCTIONS)]
