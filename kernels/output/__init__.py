"""Kernels that prepare what is written: surfaces of fluids."""
