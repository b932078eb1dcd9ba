"""Weakly compressible SPH, 59 000 particles in the splash of a breaking dam."""

import wcsph


def case(side: int = 39, start: float = 0.3, frames: int = 2):
    """See wcsph.py; timing starts when the column flows."""
    return wcsph.case(side, 3.0, start, frames)
