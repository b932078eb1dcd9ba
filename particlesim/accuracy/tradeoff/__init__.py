"""Speed against accuracy, measured: what each knob costs, and what it buys."""

from .sweep import tradeoff
from .table import Row, Tradeoff

__all__ = ["Row", "Tradeoff", "tradeoff"]
