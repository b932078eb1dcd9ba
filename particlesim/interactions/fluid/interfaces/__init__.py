"""Fluids beside each other, and the tension of their surfaces."""
