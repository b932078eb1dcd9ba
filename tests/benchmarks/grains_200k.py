"""Grains in contact, 205 000."""

import grains


def case(side: int = 59, frames: int = 1):
    """See grains.py."""
    return grains.case(side, frames)
