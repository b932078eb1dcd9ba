"""Scenes as descriptions, in NumPy on the host: particles, parts, settings, laws, samples."""

from . import sample

__version__ = "0.1.0"

__all__ = ["__version__", "sample"]
