"""Limits before a run: the largest safe substep of every part of a simulation."""
