"""Scenes as descriptions, in NumPy on the host: particles, parts, settings, laws, samples."""

__version__ = "0.1.0"
