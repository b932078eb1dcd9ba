"""Orders of convergence of sweeps, of the part of them that converges."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..statistics import Order

STRAIGHT = 0.05  # largest deviation from a power law within its part, in parts of the error
STEEP = 0.5  # of the steepest straight part: what falls slower has reached a floor, or not begun

Points = tuple[np.ndarray, np.ndarray]


def converging_part(x: np.ndarray, y: np.ndarray) -> slice:
    """The longest straight part of a falling line y(x), without floors and rough beginnings.

    Args:
        x: (n,) rising: log of the knob, from coarse to fine.
        y: (n,) log of the error.

    Returns:
        The points that follow one power law: at least three, if there are; all, if none do.
    """
    least = min(3, len(x))
    straight = []
    for start in range(len(x)):
        for stop in range(start + least, len(x) + 1):
            slope, offset = np.polyfit(x[start:stop], y[start:stop], 1)
            deviation = np.abs(slope * x[start:stop] + offset - y[start:stop]).max()
            if deviation <= np.log1p(STRAIGHT):
                straight.append((stop - start, start, -slope))
    if not straight:
        return slice(0, len(x))
    steepest = max(slope for _, _, slope in straight)
    least_steep = min(steepest, STEEP * steepest)  # both may be negative
    count, start, _ = max(each for each in straight if each[2] >= least_steep)
    return slice(start, start + count)


def fitted_order(groups: Sequence[Points], direction: int) -> Order:
    """One exponent p, error ~ knob^-p, for groups of points that each have a height of their own.

    Least squares in logarithms over the converging part of each group; groups that converge less
    than half as fast as the fastest do not converge by this knob and are left out.

    Args:
        groups: (knob, error) arrays, above 0, of at least two points.
        direction: 1 if a larger knob is finer, -1 if a smaller one is (the exponent is then that
            of the knob itself), 0 if whichever the errors fall with is.
    """
    parts = []
    for knob, errors in groups:
        if direction == 0:
            direction = -1 if np.polyfit(np.log(knob), np.log(errors), 1)[0] > 0 else 1
        x = direction * np.log(knob)
        rank = np.argsort(x, kind="stable")
        x, y = x[rank], np.log(errors[rank])
        part = converging_part(x, y)
        parts.append((x[part] - x[part].mean(), y[part] - y[part].mean()))
    slopes = [-float(x @ y) / float(x @ x) for x, y in parts]
    kept = [
        part
        for part, slope in zip(parts, slopes, strict=True)
        if slope >= min(max(slopes), STEEP * max(slopes))
    ]
    x, y = (np.concatenate([part[k] for part in kept]) for k in (0, 1))
    slope = float(x @ y) / float(x @ x)
    left = y - slope * x
    degrees = len(x) - len(kept) - 1
    error = math.sqrt(float(left @ left) / degrees / float(x @ x)) if degrees > 0 else math.inf
    return Order(-slope, error, degrees, math.exp(float(np.abs(left).max())))
