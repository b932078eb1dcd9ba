"""Kernels of an incompressible fluid."""
