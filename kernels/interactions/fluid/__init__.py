"""Fluids: terms of their pairs, what is kept of their sums, and walls."""
