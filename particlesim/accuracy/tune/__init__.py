"""Tuning: the cheapest settings under a tolerance, found by searching."""

from .report import Trial, Tuned
from .tuning import tune

__all__ = ["Trial", "Tuned", "tune"]
