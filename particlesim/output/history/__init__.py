"""Histories: what a run measures of itself, frame by frame, and their plots."""

from .plots import plot_history
from .writer import History, read_history

__all__ = ["History", "plot_history", "read_history"]
