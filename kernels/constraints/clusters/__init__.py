"""Kernels of constraints over many particles."""
