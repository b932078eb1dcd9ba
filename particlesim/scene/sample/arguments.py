"""Arguments that several samplers take."""

from __future__ import annotations

from typing import Any

import numpy as np

from ... import validate


def corners(owner: str, lower: Any, upper: Any) -> tuple[np.ndarray, np.ndarray]:
    """Two corners of a box, the lower first."""
    low = validate.vector(owner, "lower", lower, unit="length")
    high = validate.vector(owner, "upper", upper, unit="length")
    if np.any(high < low):
        raise validate.fail(
            owner, "upper", f"be at least lower {low.tolist()} [length]", high, "swap the corners"
        )
    return low, high


def make_generator(owner: str, seed: int) -> np.random.Generator:
    """Random numbers that a seed repeats."""
    return np.random.default_rng(validate.whole(owner, "seed", seed))
