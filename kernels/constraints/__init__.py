"""Kernels of XPBD constraints: tuples, contacts, boundaries, and what they share."""
