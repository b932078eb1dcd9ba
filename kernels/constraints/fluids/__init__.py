"""Fluids of constraints on density: what pairs add, and what is made of the sums."""
