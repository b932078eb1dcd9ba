"""Kernels of the renderer: views, shapes, light and pixels."""
