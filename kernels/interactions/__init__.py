"""Kernels of forces: pairs, particles, bonds and fluids."""
