"""Lennard-Jones liquid of 256 000 atoms, which no cache holds."""

import lennard_jones


def case(count: int = 256_000, frames: int = 40):
    """See lennard_jones.py."""
    return lennard_jones.case(count, frames)
