"""Fluids by constraints on density."""
