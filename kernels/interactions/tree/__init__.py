"""Kernels of sums by a tree: its order, its moments, and the walks through it."""
