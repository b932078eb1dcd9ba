"""Boundaries of further shapes."""
