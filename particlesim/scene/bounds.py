"""Boxes of a scene: what its particles are to stay in, and the one that repeats itself."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import validate

Corners = tuple[np.ndarray, np.ndarray]


def corners(bounds: Any) -> Corners | None:
    """Lower and upper corner of ``Scene(bounds=...)``; sides that are None or infinite are open."""
    if bounds is None:
        return None
    owner = "Scene"
    if np.ndim(bounds) == 0 or len(bounds) != 2 or any(np.shape(each) != (3,) for each in bounds):
        raise validate.fail(
            owner, "bounds", "be (lower, upper), three each [length]", bounds, "give both corners"
        )
    lower = _corner("lower", bounds[0], -np.inf)
    upper = _corner("upper", bounds[1], np.inf)
    if not (lower < upper).all():
        raise validate.fail(
            owner, "bounds", "have their upper corner above the lower", bounds, "swap them"
        )
    return lower, upper


def _corner(name: str, given: Any, side: float) -> np.ndarray:
    values = [side if value is None else value for value in given]
    opened = np.array([value == side for value in values])
    # The open sides are the only values that may be infinite.
    plain = [0.0 if on else value for on, value in zip(opened, values, strict=True)]
    corner = validate.vector("Scene", f"bounds {name}", plain, unit="length")
    return np.where(opened, side, corner)


def periodic_box(periodic: Any) -> tuple[np.ndarray, np.ndarray, tuple[bool, bool, bool]] | None:
    """Lower corner, upper corner and which axes are periodic; zeros on open axes."""
    if periodic is None:
        return None
    owner = "Scene"
    try:
        lengths = [len(corner) for corner in periodic]
    except TypeError:
        lengths = []
    if lengths != [3, 3]:
        raise validate.fail(
            owner, "periodic", "be (lower, upper), three each", periodic, "give both corners"
        )
    on = [lo is not None and hi is not None for lo, hi in zip(*periodic, strict=True)]
    lower = validate.vector(
        owner, "periodic lower", [a if k else 0 for a, k in zip(periodic[0], on, strict=True)]
    )
    upper = validate.vector(
        owner, "periodic upper", [a if k else 0 for a, k in zip(periodic[1], on, strict=True)]
    )
    if not any(on):
        return None
    if (upper - lower)[on].min() <= 0:
        raise validate.fail(
            owner, "periodic", "have its upper corner above the lower", periodic, "swap them"
        )
    return lower, upper, (on[0], on[1], on[2])
