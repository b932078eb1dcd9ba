"""Kernels of neighbour lists: rows, how slots are ordered for them, and when they are made."""
