"""Cloth of 101 x 101 knots, ten iterations a substep."""

import cloth


def case(side: int = 101, frames: int = 10):
    """See cloth.py."""
    return cloth.case(side, 10, frames)
