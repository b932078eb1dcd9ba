"""Kernels that every scene runs: integration, neighbour lists, loops over them, copies, sums."""
