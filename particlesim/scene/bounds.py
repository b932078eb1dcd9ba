"""Bounds of a scene: what its particles are to stay in, or the watchdog barks."""

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
