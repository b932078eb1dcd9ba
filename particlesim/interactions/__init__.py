"""Interactions: what acts at the start of a substep."""
