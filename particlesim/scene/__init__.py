"""Scenes as descriptions, in NumPy on the host: particles, parts, settings, laws, samples."""
