"""Limits before a run: the largest safe substep of every part of a simulation."""

from ...engine.probing.limit import Limit
from ...engine.probing.probe import Probe
from .check import StabilityWarning, automatic, stability, warn_if_past
from .report import Stability

__all__ = [
    "Limit",
    "Probe",
    "Stability",
    "StabilityWarning",
    "automatic",
    "stability",
    "warn_if_past",
]
