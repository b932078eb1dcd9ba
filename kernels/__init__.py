"""Warp functions and kernels: laws as pure functions, then the loops that run them.

Each module builds its kernels for one :class:`~particlesim.kernels.precision.Precision` on demand,
so a scene compiles only what it launches. This package imports Warp and itself, nothing else.
"""
